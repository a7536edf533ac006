#include <cmath>

#include <gtest/gtest.h>

#include "models.hpp"

namespace thermbal::testing {
namespace {

TEST(NetworkAnalytic, OneMassWarmsAsOneExponential) {
    const Model model = one_node(5000.0, 4.0, 80.0);
    const auto times = every(15.0, 7200.0);
    const auto simulation = simulate(model, {}, times);
    ASSERT_TRUE(simulation) << simulation.error().message;
    for (std::size_t k = 0; k < times.size(); ++k) {
        const double exact = 20.0 + 20.0 * (1.0 - std::exp(-times[k] * 4.0 / 5000.0));
        EXPECT_NEAR(simulation->reading_C(static_cast<Eigen::Index>(k), 0), exact, 1e-10) << times[k];
    }
}

TEST(NetworkAnalytic, ASensorInAWarmPlaceRisesMoreThanItsNode) {
    Model model = one_node(5000.0, 4.0, 80.0);
    model.sensors[0].place_share = 0.05;
    Inputs inputs;
    inputs.time_s = {0.0};
    inputs.first_readings = {{"T2", 23.0}};
    const auto times = every(60.0, 7200.0);
    const auto simulation = simulate(model, inputs, times);
    ASSERT_TRUE(simulation) << simulation.error().message;
    for (std::size_t k = 0; k < times.size(); ++k) {
        const double rise_C = 17.0 * (1.0 - std::exp(-times[k] * 4.0 / 5000.0));
        const auto row = static_cast<Eigen::Index>(k);
        EXPECT_NEAR(simulation->node_C(row, 0), 23.0 + rise_C, 1e-10);
        EXPECT_NEAR(simulation->reading_C(row, 0), 23.0 + 1.05 * rise_C, 1e-10);
    }
}

TEST(NetworkAnalytic, TwoMassesDecayAsTheirTwoModes) {
    // Equal masses and losses: the sum decays with g / C, the difference with (g + 2 k) / C.
    Model model = one_node(3000.0, 2.0, 0.0);
    add_node(model, "other", 3000.0);
    add_link(model, "body", "other", 5.0);
    add_link(model, "other", "ambient", 2.0);
    add_sensor(model, "T3", "other");
    Inputs inputs;
    inputs.time_s = {0.0};
    inputs.first_readings = {{"T2", 40.0}, {"T3", 25.0}};
    const auto times = every(20.0, 4000.0);
    const auto simulation = simulate(model, inputs, times);
    ASSERT_TRUE(simulation) << simulation.error().message;
    for (std::size_t k = 0; k < times.size(); ++k) {
        const double half_sum = 12.5 * std::exp(-times[k] * 2.0 / 3000.0);
        const double half_difference = 7.5 * std::exp(-times[k] * 12.0 / 3000.0);
        const auto row = static_cast<Eigen::Index>(k);
        EXPECT_NEAR(simulation->reading_C(row, 0), 20.0 + half_sum + half_difference, 1e-10);
        EXPECT_NEAR(simulation->reading_C(row, 1), 20.0 + half_sum - half_difference, 1e-10);
    }
}

TEST(NetworkAnalytic, AStepOfSpeedInsideTheSamplesIsMetExactly) {
    Model model = one_node(5000.0, 4.0, 0.0);
    add_source(model, "body", 80.0, "spindle_rpm");
    model.sources[0].exponent.value = 1.5;
    Inputs inputs;
    inputs.time_s = {0.0, 1003.7};
    inputs.columns = {{"spindle_rpm", {5000.0, -2500.0}}};  // backwards is as warm as forwards
    const std::vector<double> times = {0.0, 1000.0, 2000.0};
    const auto simulation = simulate(model, inputs, times);
    ASSERT_TRUE(simulation) << simulation.error().message;
    const double rate = 4.0 / 5000.0;
    const double at_step = 20.0 * (1.0 - std::exp(-rate * 1003.7));
    const double settles = 20.0 * std::pow(0.5, 1.5);
    const double exact = 20.0 + settles + (at_step - settles) * std::exp(-rate * (2000.0 - 1003.7));
    EXPECT_NEAR(simulation->reading_C(2, 0), exact, 1e-10);
}

TEST(NetworkAnalytic, TheAmbientMayBeAColumn) {
    Model model = one_node(5000.0, 4.0, 0.0);
    model.ambient.column = "T1";
    add_sensor(model, "T1", "ambient");
    Inputs inputs;
    inputs.time_s = {0.0, 500.0, 1000.0};
    inputs.columns = {{"T1", {std::nan(""), 21.0, 25.0}}};  // before the first value it has that one
    const std::vector<double> times = {0.0, 1000.0, 1600.0};
    const auto simulation = simulate(model, inputs, times);
    ASSERT_TRUE(simulation) << simulation.error().message;
    EXPECT_NEAR(simulation->reading_C(1, 0), 21.0, 1e-10);
    EXPECT_NEAR(simulation->reading_C(1, 1), 25.0, 1e-10) << "a sample at a row has that row's value";
    EXPECT_NEAR(simulation->reading_C(2, 0), 25.0 - 4.0 * std::exp(-600.0 * 4.0 / 5000.0), 1e-10);
}

TEST(NetworkAnalytic, HeatThatEntersIsStoredOrLost) {
    const Model model = spindle_head();
    const auto times = every(1.0, 6000.0);
    const auto simulation = simulate(model, spindle_inputs(), times);
    ASSERT_TRUE(simulation) << simulation.error().message;
    const auto& T = simulation->node_C;
    double stored_J = 0.0;
    for (Eigen::Index i = 0; i < T.cols(); ++i) {
        stored_J += model.nodes[static_cast<std::size_t>(i)].heat_capacity_J_per_K.value *
                    (T(T.rows() - 1, i) - T(0, i));
    }
    double lost_J = 0.0;
    for (Eigen::Index k = 0; k < T.rows(); ++k) {
        const double weight = k == 0 || k == T.rows() - 1 ? 0.5 : 1.0;
        lost_J += weight * (0.8 * (T(k, 0) - 20.0) + 5.0 * (T(k, 2) - 20.0) + 2.0 * (T(k, 3) - 20.0));
    }
    const double entered_J = 95.0 * (3000.0 + 1210.0 * 0.6) + 60.0 * 6000.0;
    EXPECT_NEAR(stored_J + lost_J, entered_J, 1e-5 * entered_J);  // the trapezoidal rule of this test
}

TEST(NetworkAnalytic, TwoSourcesTogetherAreTheSumOfTheirEffects) {
    const auto times = every(60.0, 6000.0);
    const auto run = [&](double bearing_W, double motor_W) {
        Model model = spindle_head();
        model.sources[0].power_W.value = bearing_W;
        model.sources[1].power_W.value = motor_W;
        const auto simulation = simulate(model, spindle_inputs(), times);
        EXPECT_TRUE(simulation);
        return simulation->node_C;
    };
    constexpr double none = 1e-9;
    const Eigen::MatrixXd both = run(95.0, 60.0) - run(none, none);
    const Eigen::MatrixXd apart = run(95.0, none) + run(none, 60.0) - 2.0 * run(none, none);
    EXPECT_LT((both - apart).lpNorm<Eigen::Infinity>(), 1e-8);
    EXPECT_GT(both.lpNorm<Eigen::Infinity>(), 5.0);
}

}  // namespace
}  // namespace thermbal::testing
