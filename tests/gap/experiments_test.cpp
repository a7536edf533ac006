#include "experiments.hpp"

#include <gmock/gmock.h>

#include "small_machine.hpp"

namespace thermbal {
namespace {

using Kind = SeparatingExperiment::Kind;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Model with(Model model, const std::string& kind, const std::string& at,
           std::vector<EffectParameter> parameters) {
    model.effects.push_back({kind, "", at, std::move(parameters), {}});
    return model;
}

/// Another bearing heat of the same size, with another power of the speed.
Model with_second_source(double power_W, double exponent) {
    Model model = small_machine();
    model.sources.push_back(model.sources.front());
    model.sources.back().name = "bearing 2";
    model.sources.back().power_W.value = power_W;
    model.sources.back().exponent.value = exponent;
    return model;
}

std::vector<SeparatingExperiment> compared(const Model& named, const Model& other) {
    const auto run = make_fit_data(named, measured_on(small_machine(), 300.0, 0.05, 3), {});
    return separating_experiments(*run, named, {{"other", "bearing", other}});
}

std::vector<Kind> kinds_that_separate(const Model& named, const Model& other) {
    std::vector<Kind> kinds;
    for (const SeparatingExperiment& one : compared(named, other)) {
        if (one.separates) kinds.push_back(one.kind);
    }
    return kinds;
}

// Heat of a motor that stays when the spindle stands, and heat that does not: hardly any speed tells them.
TEST(Experiments, OnlyACoolDownTellsHeatThatStaysFromHeatThatGoes) {
    const Model stays = with(small_machine(), "motor_heat", "bearing", {{"power_W", 12.0, 0.0}});
    const Model goes = with_second_source(12.0, 0.01);
    EXPECT_THAT(kinds_that_separate(stays, goes), ElementsAre(Kind::cool_down));
}

// 12 W at the one speed; at 60 % of it 7.2 W or 2.6 W; none at standstill.
TEST(Experiments, OnlyASecondSpeedTellsTwoPowersOfTheSpeed) {
    const auto found = compared(with_second_source(12.0, 1.0), with_second_source(12.0, 3.0));
    ASSERT_THAT(found, SizeIs(3));
    EXPECT_EQ(found[0].kind, Kind::second_speed);
    EXPECT_TRUE(found[0].separates);
    EXPECT_FALSE(found[1].separates || found[2].separates);
    // 4.6 W for 150 min into the bearing: 0.38 K over the housing, and what the housing warms by.
    EXPECT_EQ(found[0].channel, "T1");
    EXPECT_GT(found[0].difference_C, 0.38);
    EXPECT_LT(found[0].difference_C, 4.6 / 4.0);
}

// A part that nothing heats stands at the room's temperature whatever the spindle does.
TEST(Experiments, OnlyTheRoomTellsWhatAPartDoesThatNothingHeats) {
    Model machine = small_machine();
    machine.nodes.push_back({"cover", {20000.0, 0.2}});
    machine.links.push_back({"cover", "ambient", {5.0, 0.2}});
    machine.sensors.push_back({"T3", "cover", 0.05});
    machine.sensors.erase(machine.sensors.begin() + 2);
    const Model draught =
        with(machine, "airflow_change", "cover", {{"factor", 2.0, 0.0}, {"onset_s", 100.0, 0.0}});
    const Model mass = with(machine, "slow_structure", "cover",
                            {{"heat_capacity_J_per_K", 40000.0, 0.0}, {"conductance_W_per_K", 4.0, 0.0}});
    EXPECT_THAT(kinds_that_separate(draught, mass), ElementsAre(Kind::room_step));
}

TEST(Experiments, NothingPartsWhatIsTheSame) {
    const Model heat = with(small_machine(), "motor_heat", "bearing", {{"power_W", 12.0, 0.0}});
    for (const SeparatingExperiment& one : compared(heat, heat)) {
        EXPECT_EQ(one.difference_C, 0.0);
        EXPECT_EQ(one.sigmas, 0.0);
        EXPECT_FALSE(one.separates);
    }
}

TEST(Experiments, WithoutADriveOnlyTheRoomCanBeChanged) {
    Model still = with(small_machine(), "motor_heat", "bearing", {{"power_W", 12.0, 0.0}});
    still.sources.front().proportional_to.clear();
    const auto found = compared(still, still);
    ASSERT_THAT(found, SizeIs(1));
    EXPECT_EQ(found.front().kind, Kind::room_step);
}

TEST(Experiments, ARivalIsFittedToTheRun) {
    const Model truth =
        with(small_machine(), "cutting_heat", "housing", {{"power_W", 25.0, 0.0}, {"onset_s", 6000.0, 0.0}});
    const Model prior = small_machine();
    const Evidence evidence{
        prior, *make_fit_data(prior, measured_on(truth, 300.0, 0.05, 3), {}), {}, {}, {}, sequential_for};
    const auto base = explain(evidence, {}, nullptr);
    ASSERT_TRUE(base);
    const auto rivals = fitted_rivals(
        evidence, *base,
        {{"airflow_change", "housing", 0.3, 0.0}, {"", "", 0.2, 0.0}, {"motor_heat", "bed", 0.01, 0.0}}, 0.05,
        3);
    ASSERT_THAT(rivals, SizeIs(1));
    ASSERT_THAT(rivals[0].model.effects, SizeIs(1));
    EXPECT_EQ(rivals[0].model.effects[0].kind, "airflow_change");
    EXPECT_LT(rivals[0].model.effects[0].parameter("factor"), 0.95);  // less cooling instead of more heat
    EXPECT_THAT(fitted_rivals(evidence, *base, {}, 0.05, 3), IsEmpty());
}

}  // namespace
}  // namespace thermbal
