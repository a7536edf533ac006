#include "simulator/plant.hpp"

#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

#include <gmock/gmock.h>

#include "simulator/integrate.hpp"
#include "simulator/plant_source.hpp"
#include "simulator/spindle_head.hpp"
#include "simulator/truth.hpp"

namespace thermbal {
namespace {

const ChannelTruth& channel(const Truth& truth, const std::string& name) {
    return *std::ranges::find(truth.channels, name, &ChannelTruth::channel);
}

class PaperCondition : public testing::TestWithParam<Condition> {};

TEST_P(PaperCondition, T5SettlesWhereAndWhenThePaperSays) {
    const Condition& condition = GetParam();
    const auto truth = plant_truth(spindle_head(), condition.room_C, condition.drive);
    ASSERT_TRUE(truth) << truth.error().message;
    const ChannelTruth& t5 = channel(*truth, "T5");
    EXPECT_NEAR(t5.steady_state_C, condition.paper_steady_state_C, 0.1);
    EXPECT_NEAR(t5.equilibrium_time_min, condition.paper_equilibrium_time_min, 5.0);
}

TEST_P(PaperCondition, AtTheSteadyStateAllHeatGoesToTheRoom) {
    const Condition& condition = GetParam();
    const PlantDescription head = spindle_head();
    const auto settled = steady_state_C(head, condition.room_C, condition.drive);
    ASSERT_TRUE(settled);
    const auto sources = heat_sources_W(head, *settled, condition.drive);
    const auto losses = heat_losses_W(head, *settled, condition.room_C, condition.drive);
    const double in_W = std::accumulate(sources.begin(), sources.end(), 0.0);
    EXPECT_GT(in_W, 100.0);
    EXPECT_NEAR(std::accumulate(losses.begin(), losses.end(), 0.0), in_W, 1e-6);
    for (const double balance_W : heat_balance_W(head, *settled, condition.room_C, condition.drive)) {
        EXPECT_NEAR(balance_W, 0.0, 1e-6);
    }
}

TEST_P(PaperCondition, TheIntegrationEndsAtTheSteadyStateOfTheBalance) {
    const Condition& condition = GetParam();
    const auto truth = plant_truth(spindle_head(), condition.room_C, condition.drive);
    ASSERT_TRUE(truth);
    Plant plant(spindle_head(), Room{.mean_C = condition.room_C}, condition.drive);
    plant.advance_to(60.0 * 3600.0);
    const auto sensors_C = plant.sensor_C();
    for (std::size_t k = 0; k < sensors_C.size(); ++k) {
        EXPECT_NEAR(sensors_C[k], truth->channels[k].steady_state_C, 1e-3) << truth->channels[k].channel;
    }
}

INSTANTIATE_TEST_SUITE_P(All, PaperCondition, testing::ValuesIn(conditions()), [](const auto& test) {
    std::string name = test.param.name;
    std::ranges::replace(name, '-', '_');
    return name;
});

TEST(SpindleHead, HasFifteenStructuralSensorsThatBehaveDifferently) {
    const PlantDescription head = spindle_head();
    ASSERT_EQ(head.sensors.size(), 16U);
    EXPECT_EQ(head.sensors.front().channel, "T1");
    EXPECT_EQ(head.sensors.front().node, PlantSensor::room);
    std::set<std::size_t> nodes;
    for (std::size_t k = 1; k < 16; ++k) {
        EXPECT_EQ(head.sensors[k].channel, std::string("T").append(std::to_string(k + 1)));
        nodes.insert(head.sensors[k].node);
    }
    EXPECT_EQ(nodes.size(), 15U);

    const auto truth = plant_truth(head, 18.0, {5000.0, false});
    ASSERT_TRUE(truth);
    EXPECT_TRUE(std::isnan(channel(*truth, "T1").equilibrium_time_min));
    EXPECT_GT(channel(*truth, "T16").equilibrium_time_min, 3.0 * channel(*truth, "T2").equilibrium_time_min);
    EXPECT_GT(channel(*truth, "T2").steady_state_C - 18.0,
              10.0 * (channel(*truth, "T16").steady_state_C - 18.0));
}

/// One body with one linear loss: the blower's film coefficient.
PlantDescription one_body() {
    PlantDescription plant;
    plant.nodes = {
        {.name = "body", .heat_capacity_J_per_K = 1000.0, .area_m2 = 0.5, .blower_W_per_m2K = 20.0}};
    plant.running_heat = {{0, 100.0}};
    plant.sensors = {{"T1", 0, 25.0}};
    return plant;
}

TEST(Plant, OneBodyFollowsItsExponentialAndTheSensorLagsBehind) {
    Plant plant(one_body(), Room{.mean_C = 20.0}, {1000.0, false});
    const double rise_C = 10.0;
    const double tau_s = 100.0;
    const double lag_s = 25.0;
    for (const double t : {0.25, 7.0, 60.5, 100.0, 333.3, 1000.0}) {
        plant.advance_to(t);
        EXPECT_NEAR(plant.node_C()[0], 20.0 + rise_C * (1.0 - std::exp(-t / tau_s)), 1e-8) << t;
        const double lagged =
            1.0 - (tau_s * std::exp(-t / tau_s) - lag_s * std::exp(-t / lag_s)) / (tau_s - lag_s);
        EXPECT_NEAR(plant.sensor_C()[0], 20.0 + rise_C * lagged, 1e-7) << t;
    }
    const auto truth = plant_truth(one_body(), 20.0, {1000.0, false});
    ASSERT_TRUE(truth);
    EXPECT_NEAR(truth->channels[0].steady_state_C, 30.0, 1e-9);
}

TEST(Plant, BodyFollowsARoomThatCycles) {
    const double period_s = 600.0;
    Plant plant(one_body(), Room{.mean_C = 20.0, .cycle_amplitude_C = 2.0, .cycle_period_s = period_s}, {});
    plant.advance_to(20.0 * period_s + 130.0);
    const double w = 2.0 * std::numbers::pi / period_s;
    const double gain = 2.0 / std::sqrt(1.0 + std::pow(w * 100.0, 2));
    EXPECT_NEAR(plant.node_C()[0], 20.0 + gain * std::sin(w * plant.time_s() - std::atan(w * 100.0)), 1e-7);
}

TEST(Plant, RungeKuttaIsOfFourthOrder) {
    const auto error_with = [](double step) {
        std::vector<double> y = {1.0};
        for (double t = 0.0; t < 1.0 - 1e-9; t += step) {
            runge_kutta_step(
                [](double, const std::vector<double>& at) { return std::vector<double>{-at[0]}; }, t, step,
                y);
        }
        return std::abs(y[0] - std::exp(-1.0));
    };
    EXPECT_NEAR(error_with(0.1) / error_with(0.05), 16.0, 2.0);
}

TEST(Plant, HowOftenItIsAskedChangesNothing) {
    Plant often(spindle_head(), Room{}, {5000.0, false});
    Plant once(spindle_head(), Room{}, {5000.0, false});
    for (double t = 0.0; t <= 900.0; t += 0.37) often.advance_to(t);
    often.advance_to(900.0);
    once.advance_to(900.0);
    for (std::size_t k = 0; k < 16; ++k) EXPECT_NEAR(often.sensor_C()[k], once.sensor_C()[k], 1e-6);
}

TEST(Plant, FrictionFallsAsTheBearingWarms) {
    const PlantDescription head = spindle_head();
    const PlantBearing& front = head.bearings.front();
    EXPECT_GT(friction_W(head, front, 18.0, 5000.0), 1.1 * friction_W(head, front, 34.0, 5000.0));
    EXPECT_GT(friction_W(head, front, 30.0, 5000.0), friction_W(head, front, 30.0, 3000.0));
    EXPECT_EQ(friction_W(head, front, 30.0, 0.0), 0.0);
    EXPECT_NEAR(oil_viscosity_mm2_per_s(head, 40.0), 22.0, 1e-6);
    EXPECT_NEAR(oil_viscosity_mm2_per_s(head, 100.0), 4.3, 1e-6);
}

TEST(PlantSource, SpindleStartsWhenSaidAndStopsWhenTold) {
    PlantSource source(Plant(spindle_head(), Room{}, {5000.0, false}), {.noise_C = 0.0, .round_C = 0.0},
                       600.0);
    EXPECT_NEAR(source.read_C(600.0)[1], 18.0, 1e-12);
    const double warm_C = source.read_C(4200.0)[1];
    EXPECT_GT(warm_C, 25.0);
    source.run_spindle(4200.0, false);
    const double cooled_C = source.read_C(6000.0)[1];
    EXPECT_LT(cooled_C, warm_C - 3.0);
    source.run_spindle(6000.0, true);
    EXPECT_GT(source.read_C(7800.0)[1], cooled_C + 3.0);
}

TEST(PlantSource, ARecordingHasEveryScanAndTheSpeed) {
    const RecordedTest test =
        record_warm_up(Plant(spindle_head(), Room{}, {3000.0, false}), {}, 15.0, 3600.0);
    ASSERT_EQ(test.time_s.size(), 241U);
    EXPECT_EQ(test.time_s.back(), 3600.0);
    ASSERT_EQ(test.channels.size(), 16U);
    EXPECT_EQ(test.inputs.front().name, "spindle_rpm");
    EXPECT_EQ(test.inputs.front().values.back(), 3000.0);
    EXPECT_GT(test.channels[1].values.back(), 23.0);
}

}  // namespace
}  // namespace thermbal
