#pragma once

#include <span>

#include "declaration/verdict.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// The adaptive unscented Kalman filter (modes/kalman.hpp) after the samples of one channel, which are on the
/// grid of `window`. NaN before the first good one. O(1) a sample: a filter that is kept and fed one scan
/// after the other says the same.
KalmanPrediction kalman_prediction(std::span<const double> samples_C, const TestWindow& window);

}  // namespace thermbal
