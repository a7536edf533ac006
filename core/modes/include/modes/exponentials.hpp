#pragma once

#include <cstddef>
#include <limits>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// What a fit of a few exponentials says of one channel by itself. NaN where the samples do not determine it.
struct ExponentialFit {
    double start_C = std::numeric_limits<double>::quiet_NaN();
    double steady_state_C = std::numeric_limits<double>::quiet_NaN();
    double steady_state_sd_C =
        std::numeric_limits<double>::quiet_NaN();  ///< Laplace: the order taken as known
    double equilibrium_time_min =
        std::numeric_limits<double>::quiet_NaN();  ///< since the window's start, 95 %
    std::vector<double> time_constant_min;
};

/// Least squares of level + sum_k amplitude_k (1 - exp(-t/tau_k)), `exponentials` of them, t from the
/// window's start, on one channel alone and with a constant room: what one would do first, and what the
/// shared modes are compared with. The interval is the Cramer-Rao bound at the fitted curve with the
/// residuals' scatter, so it does not know that the machine has more modes. Pure; any thread. Errors
/// (refuse_input): no such channel, no samples, or fewer than the unknowns need.
Result<ExponentialFit> fit_exponentials(const TestWindow& window, std::string_view channel,
                                        std::size_t exponentials);

}  // namespace thermbal
