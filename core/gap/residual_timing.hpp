#pragma once

#include <vector>

#include "fit.hpp"

namespace thermbal {

/// What the whitened residual of all channels together says of when something happens, the strongest first.
struct ResidualTiming {
    std::vector<double> periods_s;  ///< with which it repeats; from four bins to a third of the test
    std::vector<double> moments_s;  ///< when it jumps
};

ResidualTiming residual_timing(const FitData& data, const FitPoint& point);

}  // namespace thermbal
