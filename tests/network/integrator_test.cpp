#include <cmath>

#include <gtest/gtest.h>

#include "even_table.hpp"
#include "models.hpp"
#include "network/effect.hpp"

namespace thermbal::testing {
namespace {

/// Everything that varies with temperature or smoothly with time.
Model nonlinear_head() {
    Model model = spindle_head();
    model.effects = {{"friction_viscosity", "", "bearing", {{"beta_per_K", 0.03}}, {}},
                     {"preload_growth", "", "bearing", {{"growth_per_K", 0.05}}, {}},
                     {"surface_nonlinearity", "", "", {{"exponent", 0.3}}, {}},
                     {"run_in_heat", "", "bearing", {{"power_W", 40.0}, {"time_constant_s", 900.0}}, {}},
                     {"ambient_drift", "ramp", "", {{"rate_C_per_h", 1.5}}, {}}};
    return model;
}

Eigen::MatrixXd with_step(const Model& model, double step_s) {
    const std::vector<double> times = {0.0, 5760.0};
    const auto simulation =
        simulate(model, spindle_inputs(), times, {.max_step_s = step_s, .tolerance_C = 1e9});
    EXPECT_TRUE(simulation) << simulation.error().message;
    return simulation->node_C;
}

TEST(NetworkIntegrator, HalvingTheStepShowsThirdOrder) {
    const Model model = nonlinear_head();
    const Eigen::MatrixXd reference = with_step(model, 1.0);
    // From steps on that are shorter than the fastest time constant, two minutes here.
    double before = (with_step(model, 60.0) - reference).lpNorm<Eigen::Infinity>();
    for (const double step_s : {30.0, 15.0, 7.5}) {
        const double error = (with_step(model, step_s) - reference).lpNorm<Eigen::Infinity>();
        EXPECT_GT(std::log2(before / error), 2.6) << step_s;
        before = error;
    }
    EXPECT_LT(before, 1e-5);
}

TEST(NetworkIntegrator, ATabulatedFunctionIsTheFunction) {
    const auto convection = [](double x) { return std::pow((x * x + 1.0) / 100.0, 0.75); };
    const EvenTable table(convection);
    double furthest = 0.0;
    for (double x = 0.0; x < 64.0; x += 0.0007)
        furthest = std::max(furthest, std::abs(table(x) - convection(x)));
    EXPECT_LT(furthest, 1e-6);
    EXPECT_GT(furthest, 0.0) << "or it is the function that is asked";
    EXPECT_EQ(table(64.0), convection(64.0));
    EXPECT_EQ(table(1e6), convection(1e6));
    EXPECT_TRUE(std::isnan(table(std::nan(""))));
}

TEST(NetworkIntegrator, TheToleranceBoundsTheError) {
    const Model model = nonlinear_head();
    const auto times = every(60.0, 5760.0);
    const auto exact = simulate(model, spindle_inputs(), times, {.max_step_s = 1.0, .tolerance_C = 1e9});
    const auto fast = simulate(model, spindle_inputs(), times);
    ASSERT_TRUE(exact && fast);
    EXPECT_LT((exact->node_C - fast->node_C).lpNorm<Eigen::Infinity>(), 1e-3);
    EXPECT_LT(fast->steps, 400) << "and not by steps without number";
}

TEST(NetworkIntegrator, AStiffNodeCostsStepsNotStability) {
    // A time constant of 0.1 s beside one of an hour, and a surface that is nonlinear on the fast one.
    Model model = one_node(20000.0, 4.0, 0.0);
    add_node(model, "sheet", 5.0);
    add_link(model, "body", "sheet", 1.0);
    add_link(model, "sheet", "ambient", 50.0);
    add_source(model, "sheet", 2000.0);
    model.effects = {{"surface_nonlinearity", "", "", {{"exponent", 0.3}}, {}}};
    const auto times = every(60.0, 3600.0);
    const auto simulation = simulate(model, {}, times);
    ASSERT_TRUE(simulation) << simulation.error().message;
    // The sheet is where its balance stands still, with the body's temperature given.
    const double body_C = simulation->node_C(60, 0);
    const double sheet_C = simulation->node_C(60, 1);
    const double rise = sheet_C - 20.0;
    const double lost_W = 50.0 * rise * std::pow((rise * rise + 1.0) / 100.0, 0.15);
    EXPECT_NEAR(lost_W + 1.0 * (sheet_C - body_C), 2000.0, 0.5);
    EXPECT_LT(simulation->steps, 60000);
}

TEST(NetworkIntegrator, AThermostatSwitchesAtItsTemperatures) {
    Model model = one_node(4000.0, 2.0, 100.0);
    model.effects = {{"coolant_cycling",
                      "thermostat",
                      "body",
                      {{"power_W", 150.0}, {"switch_on_C", 30.0}, {"hysteresis_C", 2.0}},
                      {}}};
    const auto times = every(1.0, 7200.0);
    const auto simulation = simulate(model, {}, times);
    ASSERT_TRUE(simulation) << simulation.error().message;
    // Closed form: up from 28 to 30 with 100 W, down with -50 W, each an exponential towards 20 + P / 2.
    const double tau = 2000.0;
    const double up_s = tau * std::log((70.0 - 28.0) / (70.0 - 30.0));
    const double down_s = tau * std::log((30.0 + 5.0) / (28.0 + 5.0));
    std::vector<double> tops;
    const auto T = simulation->reading_C.col(0);
    for (Eigen::Index k = 1; k + 1 < T.size(); ++k) {
        if (T[k] >= T[k - 1] && T[k] > T[k + 1]) tops.push_back(times[static_cast<std::size_t>(k)]);
    }
    ASSERT_GT(tops.size(), 10U);
    const double period_s = (tops.back() - tops.front()) / static_cast<double>(tops.size() - 1);
    EXPECT_NEAR(period_s, up_s + down_s, 0.1);
    EXPECT_NEAR(T.tail(3600).maxCoeff(), 30.0, 0.02);
    EXPECT_NEAR(T.tail(3600).minCoeff(), 28.0, 0.02);
}

TEST(NetworkIntegrator, HeatWithoutBoundIsAnErrorNotANumber) {
    Model model = one_node(4000.0, 0.5, 500.0);
    add_node(model, "far", 1e9);
    add_link(model, "body", "far", 0.1);
    model.effects = {{"preload_growth", "", "body", {{"growth_per_K", 0.5}}, {}}};
    const auto simulation = simulate(model, {}, every(60.0, 36000.0));
    ASSERT_FALSE(simulation);
    EXPECT_EQ(simulation.error().next, NextStep::stop);
    EXPECT_NE(simulation.error().message.find("run away"), std::string::npos) << simulation.error().message;
}

TEST(NetworkIntegrator, TheSameArgumentsGiveTheSameBits) {
    const Model model = nonlinear_head();
    const auto times = every(15.0, 6000.0);
    const auto a = simulate(model, spindle_inputs(), times);
    const auto b = simulate(model, spindle_inputs(), times);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->reading_C, b->reading_C);
}

TEST(NetworkIntegrator, TimesAndColumnsThatDoNotFitAreRefused) {
    const Model model = spindle_head();
    const auto message = [&](const Inputs& inputs, const std::vector<double>& times) {
        const auto simulation = simulate(model, inputs, times);
        EXPECT_FALSE(simulation);
        return simulation ? "" : simulation.error().message;
    };
    Inputs inputs = spindle_inputs();
    EXPECT_NE(message(inputs, {-1.0, 5.0}).find("before the inputs begin"), std::string::npos);
    EXPECT_NE(message(inputs, {5.0, 5.0}).find("do not increase"), std::string::npos);
    EXPECT_NE(message(inputs, {std::nan(""), 5.0}).find("do not increase"), std::string::npos);
    inputs.columns[0].values.pop_back();
    EXPECT_NE(message(inputs, {0.0, 5.0}).find("spindle_rpm has 4 rows"), std::string::npos);
    inputs.columns.clear();
    EXPECT_NE(message(inputs, {0.0, 5.0}).find("no column spindle_rpm"), std::string::npos);
}

}  // namespace
}  // namespace thermbal::testing
