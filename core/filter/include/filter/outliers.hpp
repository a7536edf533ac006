#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

struct OutlierOptions {
    std::size_t half_width = 7;         ///< neighbours looked at on each side
    double threshold = 5.0;             ///< in noise standard deviations (1.4826 MAD)
    double smallest_noise_sd_C = 0.06;  ///< 0.05 C noise and 0.1 C rounding; a flat stretch has MAD 0
    std::size_t longest_spike = 2;      ///< scans; what stays away longer is a step, and is kept

    /// Errors (refuse_input) name the field, its value and the bound.
    Result<void> check() const;
};

struct MarkedWindow {
    std::vector<double> values_C;     ///< the input with NaN at the spikes
    std::vector<std::size_t> spikes;  ///< their indices
    /// Newest samples that stand off and have not come back yet: spike or step, nobody can know. They are NaN
    /// too, for at most longest_spike scans.
    std::size_t undecided = 0;
};

/// Marks spikes after Hampel: a sample further than `threshold` noise standard deviations from the robust
/// line (Theil-Sen) through its neighbours, in a run of at most `longest_spike`. NaN in the input stay NaN.
/// Errors: refuse_input for options out of bounds. Pure; any thread.
Result<MarkedWindow> mark_outliers(std::span<const double> temperature_C, const OutlierOptions& options);

}  // namespace thermbal
