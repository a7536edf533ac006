#include "gap/calibrate.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "small_machine.hpp"

namespace thermbal {
namespace {

/// Every number off by its own amount, within the stated 20 %.
Model another_machine() {
    Model model = small_machine();
    double factor = 0.82;
    for (Node& node : model.nodes) node.heat_capacity_J_per_K.value *= (factor += 0.07);
    for (ThermalLink& link : model.links) link.conductance_W_per_K.value *= (factor += 0.05);
    model.sources[0].power_W.value *= 0.9;
    return model;
}

TEST(Calibrate, BringsAModelDownToTheNoise) {
    const RecordedTest test = measured_on(another_machine(), 400.0, 0.05, 1);
    const auto result = calibrate(small_machine(), test);
    ASSERT_TRUE(result.has_value()) << result.error().message;
    EXPECT_TRUE(result->converged);
    EXPECT_GT(result->before_rmse_C, 0.3);
    EXPECT_LT(result->rmse_C, 0.035);  // bins of four scans: 0.025, and the noise of the first readings
}

TEST(Calibrate, SaysHowWellANumberIsKnown) {
    const Model truth = another_machine();
    double squares = 0.0;
    int count = 0;
    for (unsigned seed = 1; seed <= 6; ++seed) {
        const auto result = calibrate(small_machine(), measured_on(truth, 400.0, 0.05, seed));
        ASSERT_TRUE(result.has_value());
        for (const CalibratedParameter& number : result->parameters) {
            EXPECT_GE(number.learned(), 0.0) << number.parameter.name;
            EXPECT_LE(number.learned(), 1.0) << number.parameter.name;
        }
        const double capacity = truth.nodes[0].heat_capacity_J_per_K.value;
        const CalibratedParameter& fitted = result->parameters[0];
        const double z = std::log(fitted.value / capacity) / fitted.sigma;
        squares += z * z;
        ++count;
    }
    EXPECT_LT(squares / count, 4.0);
}

TEST(Calibrate, ATestWithoutASensorOfTheModelIsRefused) {
    RecordedTest test = measured_on(small_machine(), 60.0, 0.05, 1);
    for (Column& channel : test.channels) channel.name += "9";
    const auto result = calibrate(small_machine(), test);
    ASSERT_FALSE(result.has_value());
    EXPECT_EQ(result.error().next, NextStep::refuse_input);
    EXPECT_NE(result.error().message.find("[[sensor]]"), std::string::npos);
}

}  // namespace
}  // namespace thermbal
