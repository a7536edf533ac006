#include "gap/calibrate.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "network/simulate.hpp"
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

TEST(Calibrate, TheModelIsTheFit) {
    const RecordedTest test = measured_on(with_two_on_the_housing(another_machine(), 0.015), 400.0, 0.05, 1);
    const auto result = calibrate(with_two_on_the_housing(small_machine(), 0.0), test);
    ASSERT_TRUE(result.has_value()) << result.error().message;
    const auto& sensors = result->model.sensors;
    EXPECT_NEAR(sensors[1].place_share - sensors[3].place_share, 0.03, 0.004);
    const Simulation simulation = simulate(result->model, inputs_of(test), test.time_s).value();
    double squares = 0.0;
    for (std::size_t c = 0; c < test.channels.size(); ++c) {
        const auto measured = Eigen::Map<const Eigen::VectorXd>(
            test.channels[c].values.data(), static_cast<Eigen::Index>(test.channels[c].values.size()));
        squares += (measured - simulation.reading_C.col(static_cast<Eigen::Index>(c))).squaredNorm() /
                   static_cast<double>(measured.size());
    }
    EXPECT_LT(std::sqrt(squares / 4.0), 0.06) << "noise of a scan: 0.05; without places 0.1";
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
