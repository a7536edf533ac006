#include "watches.hpp"

#include <cmath>

#include <fmt/format.h>

#include "daemon.hpp"

namespace thermbal {

std::vector<WatchedModule> watched_modules(const Config& config) {
    std::vector<WatchedModule> modules;
    for (std::size_t u = 0; u < config.units.size(); ++u) {
        const UnitConfig& unit = config.units[u];
        WatchedModule module{.name = unit.name, .channels = {}};
        module.frozen_after_scans =
            static_cast<std::int64_t>(std::ceil(unit.frozen_after_min * 60.0 / config.test.period_s));
        for (std::size_t c = 0; c < config.channels.size(); ++c) {
            if (config.channels[c].unit == u) module.channels.push_back(c);
        }
        modules.push_back(std::move(module));
    }
    return modules;
}

std::vector<AlarmLimit> alarm_limits(const Config& config) {
    std::vector<AlarmLimit> limits;
    limits.reserve(config.alarms.size());
    for (const AlarmConfig& alarm : config.alarms) {
        limits.push_back({.name = alarm.name,
                          .channel = alarm.channel,
                          .above_C = alarm.above_C,
                          .below_C = alarm.below_C,
                          .rate_C_per_min = alarm.rate_C_per_min,
                          .rate_over_min = alarm.rate_over_min,
                          .scans = alarm.scans});
    }
    return limits;
}

void Daemon::watch_modules(Scan& scan) {
    for (const FreezeChange& change : freeze_watch_.take(scan)) {
        const WatchedModule& module = freeze_watch_.module(change.module);
        if (!change.frozen) {
            event("thawed",
                  fmt::format("unit {}: its words change again, its samples count again", module.name));
            continue;
        }
        event(
            "frozen",
            fmt::format(
                "unit {}: it answers, but no word of it has changed from scan {} to {}: its samples "
                "are stuck until one does; switch the module off and on, or raise its frozen_after_min where "
                "nothing has moved by a step of it for so long",
                module.name, change.first_scan, scan.scan));
        if (is_measuring(test_.state)) take_back(module, change.first_scan, scan.scan - 1);
    }
}

/// What was taken for readings before the freeze could be told from chance.
void Daemon::take_back(const WatchedModule& module, std::int64_t first_scan, std::int64_t last_scan) {
    for (const std::size_t channel : module.channels) {
        auto& values_C = test_.window.channels[channel].values;
        for (std::int64_t scan = first_scan; scan <= last_scan; ++scan) {
            const auto row = static_cast<std::size_t>(scan);
            if (row < values_C.size()) values_C[row] = no_value;
        }
    }
    // What is being identified, or has been and waits to be taken, holds words that were no readings: the
    // next scan asks anew.
    test_.revised_until_scan = last_scan;
    test_.submitted_scan = test_.identified_scan.value_or(0);
    identifier_->cancel();
    test_.identifying = false;
    write([id = test_.id, channels = module.channels, first_scan, last_scan](Store& store) -> Result<void> {
        const auto marked = store.mark_stuck(id, channels, first_scan, last_scan);
        return marked ? Result<void>() : std::unexpected(marked.error());
    });
}

void Daemon::watch_time(const Scan& scan) {
    for (const TimeEvent& seen : time_watch_.take_clocks(clock_.read())) event(seen.kind, seen.message);
    if (!is_measuring(test_.state)) return;
    if (const auto seen = time_watch_.take_scan(scan)) event(seen->kind, seen->message);
}

}  // namespace thermbal
