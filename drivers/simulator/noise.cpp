#include "simulator/noise.hpp"

#include <cmath>
#include <numbers>

namespace thermbal {
namespace {

std::uint64_t splitmix64(std::uint64_t x) {
    x += 0x9E3779B97F4A7C15ULL;
    x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
    return x ^ (x >> 31U);
}

/// In (0, 1).
double uniform(std::uint64_t bits) {
    return (static_cast<double>(bits >> 11U) + 0.5) * 0x1.0p-53;
}

double rounded(double value, double step) {
    const double steps_per_one = std::round(1.0 / step);
    // 0.1 is no binary number, 10 is: dividing by it gives the double that is nearest to the decimal.
    if (std::abs(steps_per_one * step - 1.0) < 1e-12)
        return std::round(value * steps_per_one) / steps_per_one;
    return std::round(value / step) * step;
}

}  // namespace

double gaussian_at(std::uint64_t seed, std::size_t channel, std::int64_t index) {
    const std::uint64_t stream = splitmix64(seed ^ splitmix64(static_cast<std::uint64_t>(channel) + 1));
    const std::uint64_t key = splitmix64(stream ^ static_cast<std::uint64_t>(index));
    const double u = uniform(key);
    const double v = uniform(splitmix64(key));
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
}

double measured_C(double true_C, std::size_t channel, double time_s, const NoiseOptions& options) {
    double value_C = true_C;
    if (options.noise_C > 0.0) {
        const auto conversion = static_cast<std::int64_t>(std::floor(time_s / options.conversion_s));
        value_C += options.noise_C * gaussian_at(options.seed, channel, conversion);
    }
    return options.round_C > 0.0 ? rounded(value_C, options.round_C) : value_C;
}

}  // namespace thermbal
