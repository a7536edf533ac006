#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

/// A configured command. No shell: argv[0] is a path, or a name that is looked up in PATH.
struct Hook {
    std::vector<std::string> argv;
    /// Added to the daemon's environment: THERMBAL_TEST_ID, ...
    std::vector<std::pair<std::string, std::string>> environment;
    std::chrono::milliseconds timeout{30'000};  ///< then SIGTERM to its process group, SIGKILL 2 s later
};

struct HookResult {
    std::optional<int> exit_status;  ///< empty when a signal ended it
    int signal = 0;
    bool timed_out = false;

    bool succeeded() const { return exit_status == 0 && !timed_out; }
    /// "exited with status 3", "ended by signal 9 after its time limit": for an event.
    std::string describe() const;
};

/// Runs commands beside the event loop. One thread; hangs on a loop by `fd` (readable: call `dispatch`).
/// A command that still runs when the runner goes away is left running.
class HookRunner {
  public:
    using Done = std::function<void(const HookResult&)>;

    static Result<HookRunner> create();

    /// Starts the command (stdin is /dev/null) and returns; `done` is called from dispatch. `refuse_input`
    /// when it cannot be started (not found, not executable), `retry` when the system has no process to
    /// spare.
    Result<void> run(const Hook& hook, Done done);

    int fd() const;
    void dispatch();
    std::size_t running() const;

    HookRunner(HookRunner&&) noexcept;
    HookRunner& operator=(HookRunner&&) noexcept;
    ~HookRunner();

  private:
    struct Parts;
    explicit HookRunner(std::unique_ptr<Parts> parts);
    std::unique_ptr<Parts> parts_;
};

}  // namespace thermbal
