#include "declaration/live_flow.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "channel_sweep.hpp"
#include "guards.hpp"
#include "kalman_prediction.hpp"
#include "regime_estimate.hpp"

namespace thermbal {

namespace {

std::pair<std::int64_t, std::size_t> window_key(const TestWindow& window) {
    return {std::llround(window.start_s * 1e3), window.scans};
}

}  // namespace

Result<WindowVerdict> LiveFlow::identify(const TestWindow& window, const std::set<std::string>& settled,
                                         const ParallelFor& parallel_for,
                                         const std::function<bool()>& cancelled) {
    if (!options_.ambient.empty() && window.channel(options_.ambient) == nullptr) {
        return fail(NextStep::refuse_input,
                    fmt::format("the ambient channel {} is not in the test", options_.ambient));
    }
    const Regime regime = current_regime(window, options_);
    const TestWindow& since = regime.window;
    WindowVerdict verdict{
        window.end_s() / 60.0, regime.since_s / 60.0, regime.last_change_s / 60.0, {}, {}, {}};

    forget_before(since.end_s() - 2.0 * options_.guards.look_back_min * 60.0, since.period_s);
    const auto seen_earlier = [&](double look_backs) {
        return window_until(since, since.end_s() - look_backs * options_.guards.look_back_min * 60.0);
    };
    const std::array earlier{seen_earlier(1.0), seen_earlier(2.0)};
    estimate({&since, &earlier[0], &earlier[1]}, regime.start_level_C, parallel_for);
    const auto& now = estimates_.at(window_key(since));
    std::vector<const SpectrumEstimate*> shorter;
    for (const TestWindow& before : earlier) {
        const auto& estimated = estimates_.at(window_key(before));
        if (estimated) shorter.push_back(&estimated->estimate);
    }
    if (now) {
        verdict.archive_dropped = now->contradiction.reason;
        if (regime.began_with.empty()) verdict.spectrum = archived(now->estimate);
    }

    std::optional<TestWindow> sweeps_see;
    for (const Column& column : window.channels) {
        if (column.name == options_.ambient) continue;
        ChannelVerdict channel = begin_verdict(column, verdict.window_end_min);
        const Column& samples = *since.channel(column.name);
        channel.kalman = kalman_prediction(samples.values, since);
        const GuardEvidence evidence{since, samples, regime, now ? &now->estimate : nullptr, shorter};
        ask_samples(channel, evidence, options_);
        if (channel.state == ChannelState::measuring) {
            take_estimate(channel, evidence, options_);
            ask_shared_modes(channel, evidence, options_);
        }
        if (!settled.contains(channel.channel) && sweep_is_wanted(channel)) {
            if (!sweeps_see) sweeps_see = swept_window(since, options_);
            const auto sweep = swept(*sweeps_see, channel.channel, parallel_for, cancelled);
            if (cancelled()) return fail(NextStep::stop, "cancelled");
            ask_sweep(channel, sweep, options_);
        }
        conclude(channel, verdict.window_end_min, options_);
        verdict.channels.push_back(std::move(channel));
    }
    if (verdict.channels.empty()) return fail(NextStep::refuse_input, "the test has no structural channel");
    return verdict;
}

/// Only windows up to two look-backs old are asked for again; a test of days must not remember them all.
void LiveFlow::forget_before(double window_end_s, double period_s) {
    std::erase_if(estimates_, [&](const auto& entry) {
        const auto& [start_ms, scans] = entry.first;
        return static_cast<double>(start_ms) * 1e-3 + static_cast<double>(scans) * period_s < window_end_s;
    });
}

bool LiveFlow::sweep_is_wanted(const ChannelVerdict& channel) const {
    switch (options_.sweep_when) {
        case SweepWhen::always:
            return channel.state != ChannelState::dead;
        case SweepWhen::needed:
            return channel.state == ChannelState::measuring && first_failed(channel.guards) == nullptr;
        case SweepWhen::never:
            break;
    }
    return false;
}

Result<ChannelSweep> LiveFlow::swept(const TestWindow& seen, const std::string& channel,
                                     const ParallelFor& parallel_for,
                                     const std::function<bool()>& cancelled) {
    const std::pair key = window_key(seen);
    const auto known = sweeps_.find(channel);
    if (known != sweeps_.end() && known->second.window == key) return known->second.result;
    Result<ChannelSweep> result = sweep_channel(seen.channel(channel)->values, seen.start_s, seen.period_s,
                                                options_, parallel_for, cancelled);
    if (!cancelled()) sweeps_.insert_or_assign(channel, Sweep{key, result});
    return result;
}

void LiveFlow::estimate(const std::vector<const TestWindow*>& windows,
                        const std::vector<double>& start_level_C, const ParallelFor& parallel_for) {
    std::vector<const TestWindow*> unknown;
    for (const TestWindow* window : windows) {
        const auto same = [&](const TestWindow* other) { return window_key(*other) == window_key(*window); };
        if (!estimates_.contains(window_key(*window)) && std::ranges::none_of(unknown, same))
            unknown.push_back(window);
    }
    std::vector<std::optional<Result<ArchivedEstimate>>> estimated(unknown.size());
    parallel_for(unknown.size(), [&](std::size_t i) {
        estimated[i] = estimate_regime(*unknown[i], start_level_C, options_);
    });
    for (std::size_t i = 0; i < unknown.size(); ++i)
        estimates_.emplace(window_key(*unknown[i]), std::move(*estimated[i]));
}

}  // namespace thermbal
