#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "filter/denoise.hpp"

namespace thermbal::testing {

/// One share of a warm-up that settles with a time constant.
struct Exponential {
    double share, minutes;
};

inline const std::vector<Exponential> one_constant{{1.0, 42.0}};
inline const std::vector<Exponential> two_constants{{0.35, 10.0}, {0.65, 48.0}};
inline const std::vector<Exponential> three_constants{{0.2, 4.0}, {0.3, 15.0}, {0.5, 60.0}};

/// Room 18 C, rise 8.7 K, every 15 s.
inline std::vector<double> warm_up(const std::vector<Exponential>& plant, std::size_t samples) {
    std::vector<double> values(samples);
    for (std::size_t k = 0; k < samples; ++k) {
        double remaining = 0.0;
        for (const auto& [share, minutes] : plant) {
            remaining += share * std::exp(-0.25 * static_cast<double>(k) / minutes);
        }
        values[k] = 18.0 + 8.7 * (1.0 - remaining);
    }
    return values;
}

/// A warm-up as the module gives it (noise, 0.1 C rounding), filtered.
inline std::vector<double> filtered_warm_up(const std::vector<Exponential>& plant, std::size_t samples,
                                            std::uint64_t seed, double noise_sd_C = 0.05) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0.0, noise_sd_C);
    auto values = warm_up(plant, samples);
    for (double& value : values) value = std::round((value + noise(random)) * 10.0) / 10.0;
    return denoise(values, {})->values_C;
}

}  // namespace thermbal::testing
