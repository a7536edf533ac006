#include "series/calibration.hpp"

#include <cmath>

#include <gmock/gmock.h>

namespace thermbal {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Platinum, IsTheTableOfTheStandard) {
    // IEC 60751:2008, table 1: ohm at C.
    const std::pair<double, double> rows[] = {
        {-200.0, 18.52}, {-100.0, 60.26}, {-50.0, 80.31},  {0.0, 100.0},    {20.0, 107.79}, {26.0, 110.12},
        {100.0, 138.51}, {200.0, 175.86}, {400.0, 247.09}, {600.0, 313.71}, {850.0, 390.48}};
    for (const auto& [t_C, ohm] : rows) EXPECT_NEAR(resistance_ohm({}, t_C), ohm, 0.005) << t_C;
}

TEST(Platinum, TheInverseIsTheInverse) {
    for (double t_C = platinum_low_C; t_C <= platinum_high_C; t_C += 0.7) {
        EXPECT_NEAR(temperature_C({}, resistance_ohm({}, t_C)), t_C, 1e-9);
    }
    EXPECT_TRUE(std::isnan(temperature_C({}, 0.0)));
    EXPECT_TRUE(std::isnan(temperature_C({}, 1000.0)));
    EXPECT_TRUE(std::isnan(temperature_C({}, std::nan(""))));
}

TEST(Calibration, ACertificateIsAppliedThroughTheResistance) {
    Calibration calibration;
    calibration.certificate = PlatinumCoefficients{100.05, 3.9080e-3, -5.80e-7, -4.2e-12};
    for (const double true_C : {-20.0, 0.0, 18.0, 26.7, 85.0}) {
        // What a module that knows only the standard says about this very sensor.
        const double source_C = temperature_C({}, resistance_ohm(*calibration.certificate, true_C));
        EXPECT_NEAR(calibrated_C(calibration, source_C), true_C, 1e-9);
        EXPECT_GT(std::abs(source_C - true_C), 0.05);
    }
    EXPECT_TRUE(std::isnan(calibrated_C(calibration, 5000.0)));
}

TEST(Calibration, APt1000IsOneOfThousandOhm) {
    Calibration calibration;
    calibration.certificate = PlatinumCoefficients{1000.0};
    EXPECT_NEAR(calibrated_C(calibration, 26.7), 26.7, 1e-9);
}

TEST(Calibration, AnOffsetIsAddedAndNoneLeavesTheBitsAlone) {
    EXPECT_DOUBLE_EQ(calibrated_C({.offset_C = -0.15, .certificate = {}, .certificate_number = {}}, 20.0),
                     19.85);
    EXPECT_EQ(calibrated_C({}, 26.7), 26.7);
    EXPECT_TRUE(Calibration{}.none());
    EXPECT_THAT(describe(Calibration{}), IsEmpty());
}

TEST(Calibration, CoefficientsThatAreNoPlatinumAreRefused) {
    EXPECT_THAT(check_coefficients({}), IsEmpty());
    EXPECT_THAT(check_coefficients({50.0}), HasSubstr("R0_ohm is 50"));
    EXPECT_THAT(check_coefficients({100.0, 3.9083}), HasSubstr("A is 3.9083"));
    EXPECT_THAT(check_coefficients({100.0, 3.9083e-3, 5.775e-7}), HasSubstr("B is"));
    EXPECT_THAT(check_coefficients({100.0, 3.9083e-3, -5.775e-7, 4e-12}), HasSubstr("C is"));
    EXPECT_THAT(check_coefficients({std::nan("")}), HasSubstr("R0_ohm is nan"));
}

}  // namespace
}  // namespace thermbal
