#pragma once

#include <functional>
#include <span>
#include <vector>

#include "declaration/live_flow.hpp"
#include "declaration/verdict.hpp"

namespace thermbal {

/// Outliers, gaps, wavelet filter, SVR sweep over n, minimum of RMSE over n, prediction at that n. `start_s`
/// is the time of the first sample since the start of the test. Errors: refuse_input where the channel's
/// samples do not allow it (gaps, flat), stop when cancelled.
Result<ChannelSweep> sweep_channel(std::span<const double> samples_C, double start_s, double period_s,
                                   const FlowOptions& options, const ParallelFor& parallel_for,
                                   const std::function<bool()>& cancelled);

}  // namespace thermbal
