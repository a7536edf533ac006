#include "acquisition/alarm_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace thermbal {

AlarmWatch::AlarmWatch(std::vector<AlarmLimit> limits, std::size_t channels)
    : limits_(std::move(limits)), rows_(limits_.size(), std::vector<Row>(channels)), history_(channels) {
    for (const AlarmLimit& limit : limits_) {
        if (limit.rate_C_per_min) history_s_ = std::max(history_s_, limit.rate_over_min * 60.0);
    }
}

std::optional<Alarm> AlarmWatch::take(double time_s, std::span<const Sample> samples) {
    std::optional<Alarm> alarm;
    for (std::size_t channel = 0; channel < samples.size() && channel < history_.size(); ++channel) {
        if (!samples[channel].good()) continue;
        const Reading now{time_s, samples[channel].value_C};
        for (std::size_t i = 0; i < limits_.size(); ++i) {
            const AlarmLimit& limit = limits_[i];
            if (limit.channel && *limit.channel != channel) continue;
            int& row = rows_[i][channel].beyond;
            const auto what = beyond(limit, channel, now);
            row = what ? row + 1 : 0;
            if (!what || row < limit.scans || alarm) continue;
            alarm = Alarm{channel, fmt::format("{} ({}, {} good samples in a row)", *what, limit.name, row)};
        }
        remember(channel, now);
    }
    return alarm;
}

std::optional<std::string> AlarmWatch::beyond(const AlarmLimit& limit, std::size_t channel,
                                              const Reading& now) const {
    if (limit.above_C && now.value_C > *limit.above_C)
        return fmt::format("{:.2f} C is above {} C", now.value_C, *limit.above_C);
    if (limit.below_C && now.value_C < *limit.below_C)
        return fmt::format("{:.2f} C is below {} C", now.value_C, *limit.below_C);
    if (const auto rate = rate_C_per_min(limit, channel, now);
        rate && std::abs(*rate) > *limit.rate_C_per_min) {
        return fmt::format("{:+.2f} C/min is more than {} C/min", *rate, *limit.rate_C_per_min);
    }
    return std::nullopt;
}

/// Against the newest sample that is rate_over_min old or older, but not twice as old: across a long gap a
/// rate would be of something else.
std::optional<double> AlarmWatch::rate_C_per_min(const AlarmLimit& limit, std::size_t channel,
                                                 const Reading& now) const {
    if (!limit.rate_C_per_min) return std::nullopt;
    const double least_s = limit.rate_over_min * 60.0 - 1e-6;
    const auto& readings = history_[channel];
    const auto before = std::find_if(readings.rbegin(), readings.rend(), [&](const Reading& reading) {
        return now.time_s - reading.time_s >= least_s;
    });
    if (before == readings.rend() || now.time_s - before->time_s > 2.0 * least_s + 60.0) return std::nullopt;
    return (now.value_C - before->value_C) / (now.time_s - before->time_s) * 60.0;
}

void AlarmWatch::remember(std::size_t channel, const Reading& now) {
    if (history_s_ <= 0.0) return;
    auto& readings = history_[channel];
    readings.push_back(now);
    while (readings.size() > 1 && now.time_s - readings[1].time_s >= history_s_ - 1e-6) readings.pop_front();
}

}  // namespace thermbal
