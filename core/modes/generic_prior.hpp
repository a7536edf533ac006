#pragma once

#include <vector>

#include "modes/spectrum.hpp"

namespace thermbal {

/// The modes of a machine never seen before, on the grid of `options`: even on the logarithm of the time
/// constant, rarer beyond the fall-off.
struct GenericPrior {
    std::vector<double> time_constant_min;
    std::vector<double> intensity;
    std::vector<double> log_variance_mean;
    std::vector<double> log_variance_sd;
};

GenericPrior generic_prior(const SpectrumOptions& options);

}  // namespace thermbal
