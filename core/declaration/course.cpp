#include "declaration/course.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "channel_sweep.hpp"
#include "guards.hpp"
#include "regime_estimate.hpp"
#include "series/sample.hpp"

namespace thermbal {

Result<std::vector<ExpectedCourse>> expected_courses(const TestWindow& window, const FlowOptions& options,
                                                     std::span<const double> time_s) {
    const Regime regime = current_regime(window, options);
    const auto known = estimate_regime(regime.window, regime.start_level_C, options);
    if (!known) return std::unexpected(known.error());
    const SpectrumEstimate& estimate = known->estimate;
    const auto begins = std::ranges::lower_bound(time_s, regime.window.start_s);
    const std::vector<double> since_s(begins, time_s.end());
    std::vector<ExpectedCourse> courses;
    for (const ChannelEstimate& channel : estimate.channels) {
        ExpectedCourse course{channel.channel,
                              channel.steady_state_C,
                              channel.steady_state_low_C,
                              channel.steady_state_high_C,
                              {}};
        course.temperature_C.assign(time_s.size() - since_s.size(), no_value);
        std::ranges::copy(predict_curve(estimate, channel, regime.window, options.ambient, since_s),
                          std::back_inserter(course.temperature_C));
        courses.push_back(std::move(course));
    }
    return courses;
}

Result<RegressionCourse> regression_course(const TestWindow& window, const SvrPrediction& at,
                                           const std::string& channel, std::size_t scans_after,
                                           const FlowOptions& options) {
    const Regime regime = current_regime(window, options);
    const TestWindow seen = swept_window(regime.window, options);
    const Column* const samples = seen.channel(channel);
    if (samples == nullptr || at.n < 1)
        return fail(NextStep::refuse_input, fmt::format("{}: no regression on this window", channel));
    const auto filtered = filtered_samples(samples->values, options);
    if (!filtered) return std::unexpected(filtered.error());
    const double until_s = regime.window.end_s() + static_cast<double>(scans_after) * regime.window.period_s;
    const auto horizon = static_cast<std::size_t>(std::lround((until_s - seen.end_s()) / seen.period_s));
    auto run = predict(filtered->temperature_C, static_cast<std::size_t>(at.n), at.C, at.sigma, horizon,
                       options.sweep);
    if (!run) return std::unexpected(run.error());
    RegressionCourse course{seen.time_s(filtered->first), seen.period_s, std::move(run->window_C)};
    std::ranges::copy(run->predicted_C, std::back_inserter(course.temperature_C));
    return course;
}

}  // namespace thermbal
