#include "declaration/criterion.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

std::vector<double> curve(double (*rmse_C)(int)) {
    std::vector<double> values;
    for (int n = 1; n <= 35; ++n) values.push_back(rmse_C(n));
    return values;
}

TEST(Criterion, FindsTheMinimumOfAValley) {
    const auto found = find_minimum(curve([](int n) { return 0.2 + 0.01 * std::pow(n - 20, 2); }), 0.2, {});
    EXPECT_EQ(found.n, 20);
    EXPECT_DOUBLE_EQ(found.rmse_C, 0.2);
    EXPECT_TRUE(found.clear);
    EXPECT_TRUE(found.guard.passed);
}

TEST(Criterion, DepthAndScatterAreWhatTheirDefinitionsSay) {
    // y = ln RMSE alternates by +-0.1 around 0, with one value 1 below: the second differences are +-0.4.
    const auto found = find_minimum(curve([](int n) {
                                        return std::exp(n == 18 ? -1.0 : n % 2 == 0 ? 0.1 : -0.1);
                                    }),
                                    1.0, {});
    EXPECT_EQ(found.n, 18);
    EXPECT_NEAR(found.scatter, 1.4826 * 0.4 / std::sqrt(6.0), 1e-12);
    EXPECT_NEAR(found.depth, 1.0 + 0.1, 1e-12);  // the upper decile is one of the values at +0.1
}

TEST(Criterion, ACurveThatStillFallsHasNoMinimumYet) {
    const auto found = find_minimum(curve([](int n) { return 5.0 * std::exp(-0.1 * n); }), 0.02, {});
    EXPECT_EQ(found.n, 35);
    EXPECT_NEAR(found.falling, 0.5, 1e-12);
    EXPECT_FALSE(found.clear);
}

TEST(Criterion, ACurveThatEndsInAFloorHasOne) {
    const auto found = find_minimum(curve([](int n) { return 0.03 + 0.5 * std::exp(-0.4 * n); }), 0.03, {});
    EXPECT_TRUE(found.clear) << found.guard.figures;
}

TEST(Criterion, ItNeedNotLevelOffWhereItGainsLittle) {
    const auto falls = curve([](int n) { return 0.9 * std::exp(-0.1 * n); });  // the last five lags: 0.0176 C
    EXPECT_NEAR(find_minimum(falls, 0.02, {}).gain_C, 0.9 * (std::exp(-3.0) - std::exp(-3.5)), 1e-12);
    EXPECT_TRUE(find_minimum(falls, 0.02, {}).clear);
    const auto coarser = curve([](int n) { return 2.0 * std::exp(-0.1 * n); });  // 0.0392 C
    EXPECT_FALSE(find_minimum(coarser, 2.0 * 0.0392 / 1.01, {}).clear);
    EXPECT_TRUE(find_minimum(coarser, 2.0 * 0.0392 / 0.99, {}).clear);
}

TEST(Criterion, OneLagIsEnoughForAChannelOfFirstOrder) {
    const auto found = find_minimum(curve([](int n) { return 0.1 * std::exp(0.05 * n); }), 0.02, {});
    EXPECT_EQ(found.n, 1);
    EXPECT_TRUE(found.clear);
}

TEST(Criterion, NoiseAroundAConstantHasNone) {
    const auto found =
        find_minimum(curve([](int n) { return std::exp(0.2 * std::sin(2.4 * n * n)); }), 1.0, {});
    EXPECT_FALSE(found.clear) << found.guard.figures;
}

TEST(Criterion, DivergedFreeRunsCountAsWorstAndTooManyOfThemAreNoCurve) {
    auto values = curve([](int n) { return 0.2 + 0.01 * std::pow(n - 20, 2); });
    values[19] = std::numeric_limits<double>::infinity();
    EXPECT_EQ(find_minimum(values, 0.2, {}).n, 19);
    for (std::size_t i = 7; i < values.size(); ++i) values[i] = std::nan("");
    const auto found = find_minimum(values, 0.2, {});
    EXPECT_EQ(found.n, 0);
    EXPECT_FALSE(found.clear);
}

}  // namespace
}  // namespace thermbal
