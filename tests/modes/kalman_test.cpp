#include "modes/kalman.hpp"

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

/// 18 C, 8.7 C of rise by two exponentials, the slow one with its share; equal time constants: one
/// exponential.
struct WarmUp {
    double fast_min = 42.0;
    double slow_min = 42.0;
    double slow_share = 1.0;

    double at(double minute) const {
        return 18.0 - 8.7 * ((1.0 - slow_share) * std::expm1(-minute / fast_min) +
                             slow_share * std::expm1(-minute / slow_min));
    }
};

AdaptiveUnscentedKalman filtered(double minutes, const WarmUp& warm_up, std::uint64_t seed,
                                 const std::function<double(int, double)>& reading = {}) {
    AdaptiveUnscentedKalman filter{KalmanOptions{}};
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> noise(0.0, 0.05);
    for (int k = 0; 0.25 * k <= minutes; ++k) {
        const double value = warm_up.at(0.25 * k) + noise(generator);
        filter.add(reading ? reading(k, value) : value);
    }
    return filter;
}

TEST(Kalman, SettlesOnOneAndTwoExponentialsAndOnAStartThatBendsUpwards) {
    for (const WarmUp& warm_up : {WarmUp{}, WarmUp{10.0, 48.0, 0.65}, WarmUp{8.0, 50.0, 1.2}}) {
        constexpr int seeds = 40;
        int held = 0;
        double square = 0.0;
        for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
            const AdaptiveUnscentedKalman filter = filtered(120.0, warm_up, seed);
            const double error_C = filter.steady_state_C() - 26.7;
            square += error_C * error_C;
            held += std::abs(error_C) <= 1.645 * filter.steady_state_sd_C() ? 1 : 0;
            EXPECT_NEAR(filter.measurement_sd_C(), 0.05, 0.02) << seed;
        }
        EXPECT_LT(std::sqrt(square / seeds), 0.2) << warm_up.slow_share;
        EXPECT_GE(held, 34) << warm_up.slow_share;
    }
}

TEST(Kalman, SaysWhen95PercentOfTheRiseAreDone) {
    double sum_min = 0.0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed)
        sum_min += filtered(120.0, {}, seed).equilibrium_time_min();
    EXPECT_NEAR(sum_min / 20.0, 42.0 * std::log(20.0), 8.0);
    EXPECT_NEAR(filtered(300.0, {}, 1).equilibrium_time_min(), 300.0, 1.0) << "it is over: now";
}

TEST(Kalman, ASpikeIsNotBelievedAndAStepIsAfterAFewSamples) {
    const auto spiked = [](int k, double value) { return k % 50 == 20 ? value + 40.0 : value; };
    EXPECT_NEAR(filtered(120.0, {}, 1, spiked).steady_state_C(), filtered(120.0, {}, 1).steady_state_C(),
                0.1);
    const auto stepped = [](int k, double value) { return k >= 400 ? value + 5.0 : value; };
    EXPECT_NEAR(filtered(140.0, {}, 1, stepped).temperature_C(), WarmUp{}.at(140.0) + 5.0, 0.5);
}

TEST(Kalman, GetsBetterWithTime) {
    EXPECT_LT(filtered(150.0, {}, 1).steady_state_sd_C(), 0.5 * filtered(40.0, {}, 1).steady_state_sd_C());
}

TEST(Kalman, MissingSamplesMoveTimeOnAndTeachNothing) {
    const auto with_gap = [](int k, double value) { return k > 100 && k < 140 ? std::nan("") : value; };
    const AdaptiveUnscentedKalman filter = filtered(120.0, {}, 1, with_gap);
    EXPECT_NEAR(filter.steady_state_C(), filtered(120.0, {}, 1).steady_state_C(), 0.1);
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
