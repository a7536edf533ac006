#pragma once

#include <vector>

#include "fit.hpp"

namespace thermbal {

/// Periods (s) with which the whitened residual of all channels together repeats, strongest first, at most
/// `count`; from four bins to a third of the test.
std::vector<double> residual_periods_s(const FitData& data, const FitPoint& point, int count);

}  // namespace thermbal
