#include "simulator/noise.hpp"

#include <cmath>

#include <gmock/gmock.h>

namespace thermbal {
namespace {

TEST(Noise, IsStandardNormalAndUncorrelated) {
    const int n = 40000;
    double sum = 0.0;
    double squares = 0.0;
    double fourth = 0.0;
    double lagged = 0.0;
    double across = 0.0;
    for (int i = 0; i < n; ++i) {
        const double x = gaussian_at(7, 3, i);
        sum += x;
        squares += x * x;
        fourth += x * x * x * x;
        lagged += x * gaussian_at(7, 3, i + 1);
        across += x * gaussian_at(7, 4, i);
    }
    const double bound = 5.0 / std::sqrt(n);  // five standard deviations of a mean of n
    EXPECT_NEAR(sum / n, 0.0, bound);
    EXPECT_NEAR(squares / n, 1.0, bound * std::sqrt(2.0));
    EXPECT_NEAR(fourth / n, 3.0, bound * std::sqrt(96.0));
    EXPECT_NEAR(lagged / n, 0.0, bound);
    EXPECT_NEAR(across / n, 0.0, bound);
}

TEST(Noise, IsTheSameForWhoeverReadsWithinOneConversion) {
    const NoiseOptions options{.seed = 5};
    EXPECT_EQ(measured_C(20.0, 2, 30.1, options), measured_C(20.0, 2, 30.4, options));
    EXPECT_NE(gaussian_at(5, 2, 60), gaussian_at(6, 2, 60));
}

TEST(Noise, RoundsToTheModulesResolution) {
    const NoiseOptions tenths{.noise_C = 0.0, .round_C = 0.1};
    EXPECT_EQ(measured_C(26.249, 0, 0.0, tenths), 26.2);
    EXPECT_EQ(measured_C(-3.16, 0, 0.0, tenths), -3.2);
    EXPECT_EQ(measured_C(26.249, 0, 0.0, {.noise_C = 0.0, .round_C = 0.0}), 26.249);
    EXPECT_EQ(measured_C(26.3, 0, 0.0, {.noise_C = 0.0, .round_C = 0.25}), 26.25);
}

}  // namespace
}  // namespace thermbal
