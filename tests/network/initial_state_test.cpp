#include <gtest/gtest.h>

#include "models.hpp"

namespace thermbal::testing {
namespace {

Eigen::RowVectorXd start_of(const Model& model, const Inputs& inputs) {
    const std::vector<double> times = {0.0};
    const auto simulation = simulate(model, inputs, times);
    EXPECT_TRUE(simulation) << simulation.error().message;
    return simulation->node_C.row(0);
}

TEST(NetworkStart, ANodeStartsAtItsReadingOthersAtTheMeanOfThoseTheirLinksReach) {
    const auto start = start_of(spindle_head(), spindle_inputs());
    EXPECT_NEAR(start[0], 22.5, 1e-9);
    EXPECT_NEAR(start[1], (22.5 + 21.0) / 2.0, 1e-9) << "the sleeve has no sensor";
    EXPECT_NEAR(start[2], 21.0, 1e-9);
    EXPECT_NEAR(start[3], 20.4, 1e-9);
}

TEST(NetworkStart, SeveralNodesWithoutASensorFindOneAnother) {
    Model model = spindle_head();
    std::erase_if(model.sensors, [](const Sensor& sensor) { return sensor.channel == "T3"; });
    const auto start = start_of(model, spindle_inputs());
    // sleeve = (bearing + housing) / 2, housing = (sleeve + motor) / 2
    EXPECT_NEAR(start[1], 22.5 - (22.5 - 20.4) / 3.0, 1e-9);
    EXPECT_NEAR(start[2], 22.5 - (22.5 - 20.4) * 2.0 / 3.0, 1e-9);
}

TEST(NetworkStart, WithoutReadingsEverythingStartsAsTheRoom) {
    const auto start = start_of(one_node(1000.0, 1.0, 50.0), {});
    EXPECT_EQ(start[0], 20.0);
}

TEST(NetworkStart, AnOffsetIsNotTakenForHeat) {
    Model model = spindle_head();
    model.effects = {{"sensor_offset", "", "T2", {{"offset_C", 1.5}}, {}}};
    EXPECT_NEAR(start_of(model, spindle_inputs())[0], 21.0, 1e-9);
}

TEST(NetworkStart, AMassBehindANodeStartsAsTheNode) {
    Model model = spindle_head();
    model.effects = {
        {"slow_structure", "", "motor", {{"heat_capacity_J_per_K", 5e4}, {"conductance_W_per_K", 3.0}}, {}}};
    EXPECT_NEAR(start_of(model, spindle_inputs())[4], 20.4, 1e-9);
}

TEST(NetworkStart, AReadingThatComesLateIsNotTheFirst) {
    RecordedTest test;
    test.time_s = {0.0, 15.0, 900.0};
    const double none = std::nan("");
    test.channels = {{"T2", {none, 21.0, 22.0}}, {"T3", {none, none, 30.0}}};
    const Inputs inputs = inputs_of(test);
    ASSERT_EQ(inputs.first_readings.size(), 1U);
    EXPECT_EQ(inputs.first_readings[0].channel, "T2");
    EXPECT_EQ(inputs.first_readings[0].value_C, 21.0);
}

}  // namespace
}  // namespace thermbal::testing
