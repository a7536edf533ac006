#include "channel_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "series/resolution.hpp"
#include "series/sample.hpp"

namespace thermbal {
namespace {

/// When `curve_C` first reaches 95 % of the way from its first value to the steady state; NaN if it never
/// does.
double equilibrium_time_min(std::span<const double> curve_C, double steady_state_C, double start_s,
                            double period_s) {
    const double start_C = curve_C.front();
    const double target_C = start_C + 0.95 * (steady_state_C - start_C);
    const double sign = steady_state_C >= start_C ? 1.0 : -1.0;
    for (std::size_t k = 1; k < curve_C.size(); ++k) {
        if (sign * (curve_C[k] - target_C) < 0.0) continue;
        const double step_C = curve_C[k] - curve_C[k - 1];
        const double part = step_C == 0.0 ? 0.0 : (target_C - curve_C[k - 1]) / step_C;
        return (start_s + (static_cast<double>(k) - 1.0 + std::clamp(part, 0.0, 1.0)) * period_s) / 60.0;
    }
    return no_value;
}

Result<SvrPrediction> predict_at(const LagFit& fit, std::span<const double> filtered_C, double start_s,
                                 double period_s, const SweepOptions& options) {
    SvrPrediction svr{static_cast<int>(fit.n), no_value, no_value, fit.C, fit.sigma};
    if (!fit.settles) return svr;
    svr.steady_state_C = fit.steady_state_C;
    const std::size_t horizon = fit.settled_after + 1;
    const auto prediction = predict(filtered_C, fit.n, fit.C, fit.sigma, horizon, options);
    if (!prediction) return std::unexpected(prediction.error());
    std::vector<double> curve_C(filtered_C.begin(), filtered_C.end());
    curve_C.insert(curve_C.end(), prediction->predicted_C.begin(), prediction->predicted_C.end());
    svr.equilibrium_time_min = equilibrium_time_min(curve_C, fit.steady_state_C, start_s, period_s);
    return svr;
}

double rms_difference(std::span<const double> a, std::span<const double> b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
    return a.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(a.size()));
}

double last_sweep_length_s(const TestWindow& window, const FlowOptions& options) {
    const double shortest_s = options.guards.shortest_window_min * 60.0;
    const double length_s = window.end_s() - window.start_s;
    if (length_s <= shortest_s || options.sweep_growth <= 0.0) return length_s;
    const double steps = std::floor(std::log(length_s / shortest_s) / std::log1p(options.sweep_growth));
    return shortest_s * std::pow(1.0 + options.sweep_growth, steps);
}

}  // namespace

TestWindow swept_window(const TestWindow& since, const FlowOptions& options) {
    const TestWindow seen = options.sweep_when == SweepWhen::needed
                                ? window_until(since, since.start_s + last_sweep_length_s(since, options))
                                : since;
    return coarsened(seen, options.longest_sweep_scans);
}

Result<FilteredSamples> filtered_samples(std::span<const double> samples_C, const FlowOptions& options) {
    const auto marked = mark_outliers(samples_C, options.outliers);
    if (!marked) return std::unexpected(marked.error());
    const std::size_t begin = after_last_long_gap(marked->values_C, options.gaps);
    const auto filled = fill_short_gaps(std::span(marked->values_C).subspan(begin), options.gaps);
    if (!filled) return std::unexpected(filled.error());
    auto filtered = denoise(filled->values_C, options.filter);
    if (!filtered) return std::unexpected(filtered.error());
    const double rounding_C = smallest_step(samples_C) / std::sqrt(12.0);
    const double noise_C = std::max(rounding_C, rms_difference(filled->values_C, filtered->values_C));
    return FilteredSamples{begin + filled->first, std::move(filtered->values_C), begin > 0, noise_C};
}

Result<ChannelSweep> sweep_channel(std::span<const double> samples_C, double start_s, double period_s,
                                   const FlowOptions& options, const ParallelFor& parallel_for,
                                   const std::function<bool()>& cancelled) {
    const auto filtered = filtered_samples(samples_C, options);
    if (!filtered) return std::unexpected(filtered.error());
    const std::vector<double>& filtered_C = filtered->temperature_C;
    const auto swept = sweep(filtered_C, options.sweep, parallel_for, cancelled);
    if (!swept) return std::unexpected(swept.error());

    ChannelSweep result;
    for (const LagFit& fit : swept->by_lag) result.rmse_by_n_C.push_back(fit.window_rmse_C);
    result.minimum = find_minimum(result.rmse_by_n_C, filtered->noise_C, options.criterion);
    if (result.minimum.n > 0) {
        const LagFit& fit = swept->by_lag[static_cast<std::size_t>(result.minimum.n) - 1];
        const double first_s = start_s + static_cast<double>(filtered->first) * period_s;
        auto svr = predict_at(fit, filtered_C, first_s, period_s, options.sweep);
        if (!svr) return std::unexpected(svr.error());
        result.svr = *svr;
        // 95 % of the rise since the test began, which these samples have not seen.
        if (filtered->after_gap) result.svr.equilibrium_time_min = no_value;
    }
    return result;
}

}  // namespace thermbal
