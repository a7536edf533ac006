#include <algorithm>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "daemon.hpp"

namespace thermbal {
namespace {

/// A gateway starts anew and an adapter comes back within minutes; after that somebody has been there, and to
/// stop the machine would surprise them.
constexpr std::int64_t asked_for_ns = 600'000'000'000;
constexpr int attempts_before_people_are_told = 5;
constexpr std::int64_t longest_pause_ns = 5'000'000'000;

std::int64_t pause_ns_after(int attempts) {
    return std::min(longest_pause_ns, std::int64_t{1'000'000'000} << std::min(attempts - 1, 3));
}

std::string describe(const StopConfig& stop, const Config& config) {
    if (stop.action == StopConfig::Action::command) return "stop command";
    return fmt::format("{} {} of unit {} on line {} set to {}",
                       stop.action == StopConfig::Action::write_coil ? "coil" : "holding register",
                       stop.address, stop.unit_id, config.lines[stop.line].link.name, stop.value);
}

}  // namespace

/// The machine first: should the daemon die before it has stopped, the next one finds the test as it was and
/// stops the machine again, rather than finding it ended and never asking.
void Daemon::stop_machine_and_end(TestEvent how, const std::string& reason) {
    if (test_.stopping) return;
    test_.end_reason = reason;
    if (options_.config.stop.action == StopConfig::Action::none) return end_test(how, reason);
    test_.stopping = PendingStop{.how = how, .give_up_ns = real_monotonic_ns() + asked_for_ns};
    ask_to_stop();
}

void Daemon::ask_to_stop() {
    if (!test_.stopping) return;
    const StopConfig& stop = options_.config.stop;
    ++test_.stopping->attempts;
    if (stop.action == StopConfig::Action::command) return run_stop_command();
    const RegisterWrite write{stop.unit_id, stop.action == StopConfig::Action::write_coil,
                              static_cast<std::uint16_t>(stop.address),
                              static_cast<std::uint16_t>(stop.value)};
    readers_[stop.line]->write(write,
                               [this](Result<void> outcome) { stop_outcomes_.push(std::move(outcome)); });
}

void Daemon::run_stop_command() {
    const StopConfig& stop = options_.config.stop;
    const TestState state =
        test_.stopping->how == TestEvent::abort ? TestState::aborted : TestState::declared;
    const Hook hook{.argv = stop.command,
                    .environment = {{"THERMBAL_TEST_ID", std::to_string(test_.id)},
                                    {"THERMBAL_TEST_NAME", test_.name},
                                    {"THERMBAL_STATE", std::string(to_string(state))},
                                    {"THERMBAL_REASON", test_.end_reason},
                                    {"THERMBAL_DATABASE", options_.config.store.path}},
                    .timeout = std::chrono::milliseconds(static_cast<std::int64_t>(stop.timeout_s * 1e3))};
    const auto started = hooks_.run(hook, [this](const HookResult& result) {
        Result<void> outcome;
        if (!result.succeeded()) outcome = fail(NextStep::retry, "it " + result.describe());
        take_stop_outcome(outcome);
    });
    if (!started) take_stop_outcome(std::unexpected(started.error()));
}

/// The machine goes on running as long as no stop has reached it: it is asked again, and soon somebody is
/// told.
void Daemon::take_stop_outcome(const Result<void>& outcome) {
    if (!test_.stopping) return;
    const std::string what = describe(options_.config.stop, options_.config);
    PendingStop& stop = *test_.stopping;
    if (outcome) {
        event("stop_carried_out", what);
        return end_stopping();
    }
    const std::string failure = fmt::format("{} failed {} times: {}; stop the machine by hand", what,
                                            stop.attempts, outcome.error().message);
    if (real_monotonic_ns() >= stop.give_up_ns) {
        event("stop_failed", failure + "; it is not asked any more");
        return end_stopping();
    }
    if (stop.attempts == attempts_before_people_are_told) {
        event("stop_failed",
              fmt::format("{}; it is asked again for {} min", failure, asked_for_ns / 60'000'000'000));
        end_test(stop.how, test_.end_reason);
    } else {
        spdlog::warn("{}: {}; asking again", what, outcome.error().message);
    }
    wake_after(stop_timer_, pause_ns_after(stop.attempts), on_time<&Daemon::ask_to_stop>);
}

void Daemon::end_stopping() {
    const TestEvent how = test_.stopping->how;
    test_.stopping.reset();
    end_test(how, test_.end_reason);
    leave_if_done();
}

}  // namespace thermbal
