#include "declaration/course.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "channel_sweep.hpp"
#include "guards.hpp"
#include "regime_estimate.hpp"
#include "series/sample.hpp"

namespace thermbal {

VerdictCourses::VerdictCourses(const TestWindow& window, const FlowOptions& options)
    : regime_(std::make_shared<const Regime>(current_regime(window, options))), options_(options) {}

Result<std::vector<ExpectedCourse>> VerdictCourses::expected(std::span<const double> time_s) const {
    const TestWindow& window = regime_->window;
    const auto known = estimate_regime(window, regime_->start_level_C, options_);
    if (!known) return std::unexpected(known.error());
    const SpectrumEstimate& estimate = known->estimate;
    const auto begins = std::ranges::lower_bound(time_s, window.start_s);
    const std::vector<double> since_s(begins, time_s.end());
    std::vector<ExpectedCourse> courses;
    for (const ChannelEstimate& channel : estimate.channels) {
        ExpectedCourse course{channel.channel,
                              channel.steady_state_C,
                              channel.steady_state_low_C,
                              channel.steady_state_high_C,
                              {}};
        course.temperature_C.assign(time_s.size() - since_s.size(), no_value);
        std::ranges::copy(predict_curve(estimate, channel, window, options_.ambient, since_s),
                          std::back_inserter(course.temperature_C));
        courses.push_back(std::move(course));
    }
    return courses;
}

Result<RegressionCourse> VerdictCourses::regression(const SvrPrediction& at, const std::string& channel,
                                                    std::size_t scans_after) const {
    const TestWindow& window = regime_->window;
    const TestWindow seen = swept_window(window, options_);
    const Column* const samples = seen.channel(channel);
    if (samples == nullptr || at.n < 1)
        return fail(NextStep::refuse_input, fmt::format("{}: no regression on this window", channel));
    const auto filtered = filtered_samples(samples->values, options_);
    if (!filtered) return std::unexpected(filtered.error());
    const double until_s = window.end_s() + static_cast<double>(scans_after) * window.period_s;
    const auto horizon = static_cast<std::size_t>(std::lround((until_s - seen.end_s()) / seen.period_s));
    auto run = predict(filtered->temperature_C, static_cast<std::size_t>(at.n), at.C, at.sigma, horizon,
                       options_.sweep);
    if (!run) return std::unexpected(run.error());
    RegressionCourse course{seen.time_s(filtered->first), seen.period_s, std::move(run->window_C)};
    std::ranges::copy(run->predicted_C, std::back_inserter(course.temperature_C));
    return course;
}

}  // namespace thermbal
