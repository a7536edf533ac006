#pragma once

#include <cstddef>
#include <cstdint>

namespace thermbal {

/// What stands between a sensor's temperature and the module's number.
struct NoiseOptions {
    std::uint64_t seed = 1;
    double noise_C = 0.05;  ///< standard deviation of the white noise
    double round_C = 0.1;   ///< the module's resolution; 0: none
    /// The module converts once in so long: two reads within one conversion see the same noise.
    double conversion_s = 0.5;
};

/// A number of the standard normal distribution that depends on nothing but its arguments, so that who reads
/// when, and how often, changes no reading.
double gaussian_at(std::uint64_t seed, std::size_t channel, std::int64_t index);

double measured_C(double true_C, std::size_t channel, double time_s, const NoiseOptions& options);

}  // namespace thermbal
