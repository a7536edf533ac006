#include "service/hooks.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <map>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/epoll.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/errno_text.hpp"
#include "descriptor.hpp"

namespace thermbal {

namespace {

constexpr std::chrono::milliseconds grace{2000};

void set_timer(int timer, std::chrono::milliseconds after) {
    itimerspec when{};
    when.it_value.tv_sec = after.count() / 1000;
    when.it_value.tv_nsec = after.count() % 1000 * 1'000'000;
    timerfd_settime(timer, 0, &when, nullptr);
}

/// The daemon's environment with the hook's variables added, or put in place of its own.
std::vector<std::string> environment_of(const Hook& hook) {
    std::vector<std::string> environment;
    for (char** entry = environ; *entry != nullptr; ++entry) {
        const std::string text(*entry);
        const auto name = text.substr(0, text.find('='));
        const bool replaced = std::any_of(hook.environment.begin(), hook.environment.end(),
                                          [&](const auto& variable) { return variable.first == name; });
        if (!replaced) environment.push_back(text);
    }
    for (const auto& [name, value] : hook.environment)
        environment.push_back(fmt::format("{}={}", name, value));
    return environment;
}

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    pointers.reserve(texts.size() + 1);
    for (auto& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

/// A process group of its own, no descriptor but stdin (/dev/null), stdout and stderr, no signal blocked or
/// ignored.
class SpawnSettings {
  public:
    SpawnSettings() {
        posix_spawn_file_actions_init(&files_);
        posix_spawn_file_actions_addopen(&files_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addclosefrom_np(&files_, STDERR_FILENO + 1);
        sigset_t none;
        sigset_t all;
        sigemptyset(&none);
        sigfillset(&all);
        posix_spawnattr_init(&attributes_);
        posix_spawnattr_setsigmask(&attributes_, &none);
        posix_spawnattr_setsigdefault(&attributes_, &all);
        posix_spawnattr_setpgroup(&attributes_, 0);
        posix_spawnattr_setflags(&attributes_,
                                 POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    }
    SpawnSettings(const SpawnSettings&) = delete;
    SpawnSettings& operator=(const SpawnSettings&) = delete;
    ~SpawnSettings() {
        posix_spawn_file_actions_destroy(&files_);
        posix_spawnattr_destroy(&attributes_);
    }

    /// 0, or an errno value.
    int spawn(pid_t& pid, std::vector<std::string> argv, std::vector<std::string> environment) const {
        auto arguments = pointers_to(argv);
        auto variables = pointers_to(environment);
        return posix_spawnp(&pid, arguments[0], &files_, &attributes_, arguments.data(), variables.data());
    }

  private:
    posix_spawn_file_actions_t files_;
    posix_spawnattr_t attributes_;
};

enum class Event : std::uint8_t { ended = 0, time_is_up = 1 };

}  // namespace

std::string HookResult::describe() const {
    const char* why = timed_out ? " after its time limit" : "";
    if (exit_status) return fmt::format("exited with status {}{}", *exit_status, why);
    return fmt::format("ended by signal {}{}", signal, why);
}

struct HookRunner::Parts {
    struct Running {
        pid_t pid = 0;
        Descriptor process;
        Descriptor timer;
        bool timed_out = false;
        Done done;
    };

    Descriptor epoll;
    std::map<std::uint64_t, Running> running;
    std::uint64_t next_id = 1;

    bool watch(int fd, std::uint64_t id, Event event) const {
        epoll_event entry{};
        entry.events = EPOLLIN;
        entry.data.u64 = id << 1U | static_cast<std::uint64_t>(event);
        return epoll_ctl(epoll.get(), EPOLL_CTL_ADD, fd, &entry) == 0;
    }
    void end(std::uint64_t id);
    void time_is_up(Running& hook) const;
};

void HookRunner::Parts::end(std::uint64_t id) {
    siginfo_t info{};
    if (waitid(P_PIDFD, static_cast<id_t>(running.at(id).process.get()), &info, WEXITED | WNOHANG) != 0 ||
        info.si_pid == 0)
        return;
    auto hook = running.extract(id);
    HookResult result;
    result.timed_out = hook.mapped().timed_out;
    if (info.si_code == CLD_EXITED)
        result.exit_status = info.si_status;
    else
        result.signal = info.si_status;
    if (hook.mapped().done) hook.mapped().done(result);
}

void HookRunner::Parts::time_is_up(Running& hook) const {
    std::uint64_t expirations = 0;
    if (read(hook.timer.get(), &expirations, sizeof expirations) < 0) return;
    kill(-hook.pid, hook.timed_out ? SIGKILL : SIGTERM);
    if (!hook.timed_out) set_timer(hook.timer.get(), grace);
    hook.timed_out = true;
}

HookRunner::HookRunner(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
HookRunner::HookRunner(HookRunner&&) noexcept = default;
HookRunner& HookRunner::operator=(HookRunner&&) noexcept = default;
HookRunner::~HookRunner() = default;

Result<HookRunner> HookRunner::create() {
    auto parts = std::make_unique<Parts>();
    parts->epoll = Descriptor(epoll_create1(EPOLL_CLOEXEC));
    if (!parts->epoll.valid()) return fail(NextStep::retry, fmt::format("hooks: {}", errno_text(errno)));
    return HookRunner(std::move(parts));
}

Result<void> HookRunner::run(const Hook& hook, Done done) {
    if (hook.argv.empty() || hook.argv.front().empty())
        return fail(NextStep::refuse_input, "hook: no command; give a list of a program and its arguments");
    Parts::Running running;
    running.done = std::move(done);
    running.timer = Descriptor(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
    if (!running.timer.valid()) return fail(NextStep::retry, fmt::format("hook: {}", errno_text(errno)));
    const int code = SpawnSettings().spawn(running.pid, hook.argv, environment_of(hook));
    if (code != 0) {
        const bool passing = code == EAGAIN || code == ENOMEM || code == EMFILE || code == ENFILE;
        return fail(passing ? NextStep::retry : NextStep::refuse_input,
                    fmt::format("hook {}: cannot be started: {}", hook.argv.front(), errno_text(code)));
    }
    running.process = Descriptor(static_cast<int>(syscall(SYS_pidfd_open, running.pid, 0)));
    set_timer(running.timer.get(), std::max(hook.timeout, std::chrono::milliseconds(1)));
    const auto id = parts_->next_id++;
    const bool watched = running.process.valid() && parts_->watch(running.process.get(), id, Event::ended) &&
                         parts_->watch(running.timer.get(), id, Event::time_is_up);
    if (!watched)
        return fail(NextStep::stop, fmt::format("hook {}: runs, but cannot be watched: {}", hook.argv.front(),
                                                errno_text(errno)));
    parts_->running.emplace(id, std::move(running));
    return {};
}

int HookRunner::fd() const {
    return parts_->epoll.get();
}

void HookRunner::dispatch() {
    std::array<epoll_event, 16> events;
    const int count = epoll_wait(parts_->epoll.get(), events.data(), static_cast<int>(events.size()), 0);
    for (int i = 0; i < count; ++i) {
        const auto key = events[static_cast<std::size_t>(i)].data.u64;
        const auto hook = parts_->running.find(key >> 1U);
        if (hook == parts_->running.end()) continue;
        if (static_cast<Event>(key & 1U) == Event::ended)
            parts_->end(hook->first);
        else
            parts_->time_is_up(hook->second);
    }
}

std::size_t HookRunner::running() const {
    return parts_->running.size();
}

}  // namespace thermbal
