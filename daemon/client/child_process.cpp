#include "child_process.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/errno_text.hpp"

namespace thermbal {
namespace {

using Clock = std::chrono::steady_clock;

/// In the child, between fork and exec: only what is safe there.
[[noreturn]] void become(const std::vector<char*>& words, int output_fd, pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(127);  // the parent died before this line
    setpgid(0, 0);
    const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
    if (nowhere < 0) _exit(127);
    dup2(nowhere, STDIN_FILENO);
    dup2(output_fd >= 0 ? output_fd : nowhere, STDOUT_FILENO);
    execv(words[0], words.data());
    _exit(127);
}

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& words, bool read_output) {
    if (access(words.front().c_str(), X_OK) != 0)
        return fail(NextStep::stop, fmt::format("{}: {}", words.front(), errno_text(errno)));
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    std::array<int, 2> ends = {-1, -1};
    if (read_output && pipe2(ends.data(), O_CLOEXEC) != 0)
        return fail(NextStep::stop, fmt::format("pipe: {}", errno_text(errno)));
    const pid_t parent = getpid();
    const pid_t pid = fork();
    if (pid == 0) become(arguments, ends[1], parent);
    if (ends[1] >= 0) close(ends[1]);
    if (pid < 0) {
        if (ends[0] >= 0) close(ends[0]);
        return fail(NextStep::stop, fmt::format("{}: {}", words.front(), errno_text(errno)));
    }
    return ChildProcess(pid, ends[0]);
}

bool ChildProcess::read_more(Clock::time_point deadline) {
    if (output_fd_ < 0) return false;
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd ready{output_fd_, POLLIN, 0};
    if (left < 0 || poll(&ready, 1, static_cast<int>(left)) <= 0) return false;
    std::array<char, 4096> buffer{};
    const ssize_t got = read(output_fd_, buffer.data(), buffer.size());
    if (got <= 0) return false;
    unread_.append(buffer.data(), static_cast<std::size_t>(got));
    return true;
}

std::optional<std::string> ChildProcess::read_line(std::chrono::milliseconds limit) {
    const auto deadline = Clock::now() + limit;
    while (unread_.find('\n') == std::string::npos)
        if (!read_more(deadline)) return std::nullopt;
    const std::size_t end = unread_.find('\n');
    std::string line = unread_.substr(0, end);
    unread_.erase(0, end + 1);
    return line;
}

std::string ChildProcess::read_all(std::chrono::milliseconds limit) {
    const auto deadline = Clock::now() + limit;
    while (read_more(deadline)) {
    }
    return std::exchange(unread_, {});
}

std::optional<int> ChildProcess::ended() {
    int status = 0;
    if (!status_ && pid_ > 0 && waitpid(pid_, &status, WNOHANG) == pid_)
        status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return status_;
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      output_fd_(std::exchange(other.output_fd_, -1)),
      unread_(std::move(other.unread_)),
      status_(other.status_) {}

ChildProcess::~ChildProcess() {
    if (output_fd_ >= 0) close(output_fd_);
    if (pid_ <= 0 || ended()) return;
    kill(pid_, SIGTERM);
    const auto give_up = Clock::now() + std::chrono::seconds(5);
    while (!ended() && Clock::now() < give_up) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (ended()) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
}

}  // namespace thermbal
