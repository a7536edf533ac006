#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "daemon.hpp"

namespace thermbal {

void Daemon::carry_out_stop(TestState state) {
    const StopConfig& stop = options_.config.stop;
    switch (stop.action) {
        case StopConfig::Action::none:
            return;
        case StopConfig::Action::write_coil:
        case StopConfig::Action::write_register:
            write_stop_register();
            return;
        case StopConfig::Action::command:
            break;
    }
    const Hook hook{.argv = stop.command,
                    .environment = {{"THERMBAL_TEST_ID", std::to_string(test_.id)},
                                    {"THERMBAL_TEST_NAME", test_.name},
                                    {"THERMBAL_STATE", std::string(to_string(state))},
                                    {"THERMBAL_REASON", test_.end_reason},
                                    {"THERMBAL_DATABASE", options_.config.store.path}},
                    .timeout = std::chrono::milliseconds(static_cast<std::int64_t>(stop.timeout_s * 1e3))};
    const auto started = hooks_.run(hook, [this](const HookResult& result) {
        event(result.succeeded() ? "stop_carried_out" : "stop_failed",
              fmt::format("stop command {}", result.describe()));
    });
    if (!started) event("stop_failed", started.error().message);
}

void Daemon::write_stop_register() {
    const StopConfig& stop = options_.config.stop;
    ++test_.stop_attempts;
    const RegisterWrite write{stop.unit_id, stop.action == StopConfig::Action::write_coil,
                              static_cast<std::uint16_t>(stop.address),
                              static_cast<std::uint16_t>(stop.value)};
    readers_[stop.line]->write(write,
                               [this](Result<void> outcome) { stop_outcomes_.push(std::move(outcome)); });
}

/// A stop that did not reach the machine is tried again: the machine goes on running as long as it has not.
void Daemon::take_stop_outcome(const Result<void>& outcome) {
    constexpr int most_attempts = 5;
    const StopConfig& stop = options_.config.stop;
    const std::string what =
        fmt::format("{} {} of unit {} on line {} set to {}",
                    stop.action == StopConfig::Action::write_coil ? "coil" : "holding register", stop.address,
                    stop.unit_id, options_.config.lines[stop.line].link.name, stop.value);
    if (outcome) {
        event("stop_carried_out", what);
    } else if (test_.stop_attempts < most_attempts) {
        spdlog::warn("{}: {}; trying again", what, outcome.error().message);
        write_stop_register();
    } else {
        event("stop_failed", fmt::format("{} failed {} times: {}; stop the machine by hand", what,
                                         most_attempts, outcome.error().message));
    }
}

}  // namespace thermbal
