#pragma once

#include <functional>
#include <span>
#include <vector>

#include "declaration/live_flow.hpp"
#include "declaration/verdict.hpp"

namespace thermbal {

/// A channel as the regression sees it: outliers taken out, short gaps filled, denoised. After a gap that is
/// too long to be filled it begins anew: lags reach across no gap.
struct FilteredSamples {
    std::size_t first = 0;  ///< sample of the channel that temperature_C begins with
    std::vector<double> temperature_C;
    bool after_gap = false;
    double noise_C = 0.0;  ///< of one reading: what the filter took out, at least what rounding leaves
};
/// Errors (refuse_input): the samples do not allow it (none, too few).
Result<FilteredSamples> filtered_samples(std::span<const double> samples_C, const FlowOptions& options);

/// What of a regime's window the sweep sees: with SweepWhen::needed the longest of those that each are
/// `sweep_growth` longer than the one before, otherwise all; averaged down to longest_sweep_scans.
TestWindow swept_window(const TestWindow& since, const FlowOptions& options);

/// Outliers, gaps, wavelet filter, SVR sweep over n, minimum of RMSE over n, prediction at that n. `start_s`
/// is the time of the first sample since the start of the test. Errors: refuse_input where the channel's
/// samples do not allow it (gaps, flat), stop when cancelled.
Result<ChannelSweep> sweep_channel(std::span<const double> samples_C, double start_s, double period_s,
                                   const FlowOptions& options, const ParallelFor& parallel_for,
                                   const std::function<bool()>& cancelled);

}  // namespace thermbal
