#include "modes/kalman.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

AdaptiveUnscentedKalman filtered(double minutes, double tau_min, std::uint64_t seed, bool with_gap = false) {
    AdaptiveUnscentedKalman filter{KalmanOptions{}};
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> noise(0.0, 0.05);
    for (int k = 0; 0.25 * k <= minutes; ++k) {
        const double value = 18.0 - 8.7 * std::expm1(-0.25 * k / tau_min) + noise(generator);
        filter.add(with_gap && k > 100 && k < 140 ? std::nan("") : value);
    }
    return filter;
}

TEST(Kalman, SettlesOnASingleExponential) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        const AdaptiveUnscentedKalman filter = filtered(120.0, 42.0, seed);
        EXPECT_NEAR(filter.steady_state_C(), 26.7, 0.15) << seed;
        EXPECT_NEAR(filter.time_constant_min(), 42.0, 3.0) << seed;
        EXPECT_NEAR(filter.measurement_sd_C(), 0.05, 0.02) << seed;
        EXPECT_NEAR(filter.equilibrium_time_min(), 42.0 * std::log(20.0), 8.0) << seed;
    }
}

TEST(Kalman, GetsBetterWithTime) {
    EXPECT_LT(filtered(150.0, 42.0, 1).steady_state_sd_C(),
              0.5 * filtered(40.0, 42.0, 1).steady_state_sd_C());
}

TEST(Kalman, MissingSamplesMoveTimeOnAndTeachNothing) {
    const AdaptiveUnscentedKalman filter = filtered(120.0, 42.0, 1, true);
    EXPECT_NEAR(filter.steady_state_C(), 26.7, 0.2);
    EXPECT_EQ(filter.samples(), 481U - 39U);
}

TEST(Kalman, OptionsOutOfBoundsAreNamed) {
    KalmanOptions options;
    options.forgetting = 1.5;
    const Result<void> valid = options.check();
    ASSERT_FALSE(valid.has_value());
    EXPECT_NE(valid.error().message.find("forgetting"), std::string::npos);
}

}  // namespace
}  // namespace thermbal
