#include "filter/denoise.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

/// The three plants of the measurements in core/filter/README.md: room 18 C, rise 8.7 K, 15 s.
struct Exponential {
    double share, minutes;
};
using Plant = std::vector<Exponential>;
const Plant plants[] = {{{1.0, 42.0}}, {{0.35, 10.0}, {0.65, 48.0}}, {{0.2, 4.0}, {0.3, 15.0}, {0.5, 60.0}}};

std::vector<double> warm_up(const Plant& plant, std::size_t samples) {
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

std::vector<double> measured(const std::vector<double>& truth, std::mt19937_64& random) {
    std::normal_distribution<double> noise(0.0, 0.05);
    std::vector<double> values;
    values.reserve(truth.size());
    for (const double value : truth) values.push_back(std::round((value + noise(random)) * 10.0) / 10.0);
    return values;
}

struct NewestError {
    double bias_C = 0.0;  ///< of the mean over the newest samples
    double rms_C = 0.0;   ///< of one sample among them
};

NewestError newest_error(const Plant& plant, std::size_t samples, std::size_t newest,
                         const DenoiseOptions& options) {
    constexpr int repetitions = 300;
    const auto truth = warm_up(plant, samples);
    std::mt19937_64 random(11);
    NewestError error;
    for (int repetition = 0; repetition < repetitions; ++repetition) {
        const auto filtered = denoise(measured(truth, random), options);
        for (std::size_t k = samples - newest; k < samples; ++k) {
            const double difference = filtered->values_C[k] - truth[k];
            error.bias_C += difference;
            error.rms_C += difference * difference;
        }
    }
    const double count = repetitions * static_cast<double>(newest);
    return {error.bias_C / count, std::sqrt(error.rms_C / count)};
}

TEST(Denoise, DoesNotBendTheNewestSamples) {
    for (const Plant& plant : plants) {
        for (const std::size_t samples : {192U, 480U, 1600U}) {
            for (const std::size_t newest : {1U, 5U, 20U}) {
                SCOPED_TRACE(std::to_string(plant.size()) + " constants, " + std::to_string(samples) +
                             " samples, last " + std::to_string(newest));
                const auto error = newest_error(plant, samples, newest, {});
                // 300 repetitions at 0.025 C: the bias itself is known to +-0.003 C (2 sd).
                EXPECT_LT(std::abs(error.bias_C), 0.008);
                EXPECT_LT(error.rms_C, 0.035);
            }
        }
    }
}

TEST(Denoise, TheBoundaryModesOfTheTransformDoWorse) {
    DenoiseOptions smooth;
    smooth.extension = Extension::boundary_mode;
    DenoiseOptions symmetric = smooth;
    symmetric.boundary = Boundary::symmetric;
    EXPECT_GT(newest_error(plants[1], 192, 1, smooth).rms_C, 2.0 * newest_error(plants[1], 192, 1, {}).rms_C);
    EXPECT_LT(newest_error(plants[1], 192, 1, symmetric).bias_C, -0.012);
}

TEST(Denoise, FindsTheNoiseAndRemovesMostOfIt) {
    std::mt19937_64 random(5);
    const auto truth = warm_up(plants[0], 1600);
    const auto filtered = denoise(measured(truth, random), {});
    ASSERT_TRUE(filtered);
    EXPECT_NEAR(filtered->noise_sd_C, std::sqrt(0.05 * 0.05 + 0.01 / 12.0), 0.006);
    double sum = 0.0;
    for (std::size_t k = 100; k < truth.size(); ++k) sum += std::pow(filtered->values_C[k] - truth[k], 2);
    EXPECT_LT(std::sqrt(sum / 1500.0), 0.018);
}

TEST(Denoise, LeavesACubicWithoutNoiseAsItIs) {
    std::vector<double> cubic(200);
    for (std::size_t k = 0; k < cubic.size(); ++k) {
        const double x = static_cast<double>(k) / 100.0;
        cubic[k] = 18.0 + 8.0 * x - 3.0 * x * x + 0.4 * x * x * x;
    }
    const auto filtered = denoise(cubic, {});
    ASSERT_TRUE(filtered);
    // The noise scale of a noiseless curve is what its bend leaves in the finest details.
    for (std::size_t k = 0; k < cubic.size(); ++k) EXPECT_NEAR(filtered->values_C[k], cubic[k], 1e-3) << k;
}

TEST(Denoise, RefusesWhatItCannotFilter) {
    const std::vector<double> flat(100, 20.0);
    auto gap = flat;
    gap[50] = NAN;
    EXPECT_EQ(denoise(gap, {}).error().next, NextStep::refuse_input);
    EXPECT_FALSE(denoise(std::vector<double>(5, 20.0), {}));
    DenoiseOptions options;
    options.wavelet = "db44";
    EXPECT_FALSE(denoise(flat, options));
    options = {};
    options.newest_degree = 80;
    EXPECT_NE(denoise(flat, options).error().message.find("newest_degree = 80"), std::string::npos);
    const auto filtered = denoise(flat, {});
    ASSERT_TRUE(filtered);
    for (const double value : filtered->values_C) EXPECT_NEAR(value, 20.0, 1e-12);
}

}  // namespace
}  // namespace thermbal
