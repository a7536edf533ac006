#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "base/error.hpp"

namespace thermbal {

/// A program that this one started, in a process group of its own: Ctrl-C at the terminal reaches only us.
/// Ended (SIGTERM, after 5 s SIGKILL) by the destructor, and by the kernel when this process dies first.
class ChildProcess {
  public:
    /// `words`: program and arguments, no shell. With `read_output` its standard output is read by
    /// read_line(), else it goes nowhere; standard error stays.
    static Result<ChildProcess> start(const std::vector<std::string>& words, bool read_output);

    /// The next line of its output; nullopt at its end or after `limit`.
    std::optional<std::string> read_line(std::chrono::milliseconds limit);
    /// Everything up to the end of its output.
    std::string read_all(std::chrono::milliseconds limit);

    /// The exit status once it has ended (128 + signal when a signal ended it).
    std::optional<int> ended();

    ChildProcess(ChildProcess&& other) noexcept;
    ChildProcess& operator=(ChildProcess&&) = delete;
    ~ChildProcess();

  private:
    ChildProcess(pid_t pid, int output_fd) : pid_(pid), output_fd_(output_fd) {}
    /// More output into unread_; false at the end or after the deadline.
    bool read_more(std::chrono::steady_clock::time_point deadline);

    pid_t pid_ = -1;
    int output_fd_ = -1;
    std::string unread_;
    std::optional<int> status_;
};

}  // namespace thermbal
