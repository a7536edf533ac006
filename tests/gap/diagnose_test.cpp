#include "gap/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "carry_over.hpp"
#include "network/effect.hpp"
#include "network/simulate.hpp"
#include "small_machine.hpp"

namespace thermbal {
namespace {

Model with(const std::string& kind, const std::string& at, std::vector<EffectParameter> parameters) {
    Model model = small_machine();
    model.effects.push_back({kind, "", at, std::move(parameters), {}});
    return model;
}

Result<Diagnosis> diagnosis_of(const Model& truth) {
    return diagnose(small_machine(), measured_on(truth, 300.0, 0.05, 7), {}, {}, sequential_for);
}

TEST(Diagnose, AgreesWhereNothingIsMissing) {
    const auto diagnosis = diagnosis_of(small_machine());
    ASSERT_TRUE(diagnosis.has_value()) << diagnosis.error().message;
    EXPECT_EQ(diagnosis->verdict, GapVerdict::agrees) << diagnosis->reason;
    EXPECT_TRUE(diagnosis->effects.empty());
    EXPECT_TRUE(diagnosis->disagreements.empty());
}

TEST(Diagnose, FindsHeatThatSetsIn) {
    const auto diagnosis =
        diagnosis_of(with("cutting_heat", "housing", {{"power_W", 25.0, 0.0}, {"onset_s", 7200.0, 0.0}}));
    ASSERT_TRUE(diagnosis.has_value()) << diagnosis.error().message;
    ASSERT_EQ(diagnosis->effects.size(), 1u) << diagnosis->reason;
    const FoundEffect& found = diagnosis->effects.front();
    EXPECT_EQ(diagnosis->verdict, GapVerdict::explained);
    EXPECT_EQ(found.effect.kind, "cutting_heat");
    EXPECT_EQ(found.at, "housing");
    EXPECT_NEAR(found.from_s, 7200.0, 120.0);
    EXPECT_NEAR(found.effect.parameter("power_W"), 25.0, 4.0);
    EXPECT_GT(found.probability, 0.9);
    EXPECT_LT(diagnosis->run.after_rmse_C, 0.056);
    EXPECT_FALSE(diagnosis->disagreements.empty());
    // What is written says in watts how well it is known; the fit says it of the logarithm.
    const CalibratedParameter& fitted = found.parameters.front();
    ASSERT_TRUE(fitted.parameter.logarithmic);
    EXPECT_NEAR(found.effect.parameters.front().sigma, 25.0 * fitted.sigma, 0.2 * 25.0 * fitted.sigma);
}

/// A minute after the spindle stops.
Result<Diagnosis> with_a_change_of_air_beside_the_stop(double factor) {
    return diagnosis_of(
        with("airflow_change", "housing", {{"factor", factor, 0.0}, {"onset_s", 12060.0, 0.0}}));
}

TEST(Diagnose, WhatSetsInBesideAChangeOfSpeedHasToBePlain) {
    const auto plain = with_a_change_of_air_beside_the_stop(2.5);
    ASSERT_TRUE(plain.has_value()) << plain.error().message;
    ASSERT_EQ(plain->effects.size(), 1u) << plain->reason;
    EXPECT_EQ(plain->effects.front().effect.kind, "airflow_change");
    EXPECT_NEAR(plain->effects.front().from_s, 12060.0, 300.0);
    const auto faint = with_a_change_of_air_beside_the_stop(1.1);
    ASSERT_TRUE(faint.has_value()) << faint.error().message;
    for (const FoundEffect& found : faint->effects) EXPECT_NE(found.effect.kind, "airflow_change");
}

TEST(Diagnose, ASensorIsNotTheMachine) {
    const auto diagnosis = diagnosis_of(with("sensor_drift", "T2", {{"rate_C_per_h", 0.3, 0.0}}));
    ASSERT_TRUE(diagnosis.has_value()) << diagnosis.error().message;
    ASSERT_EQ(diagnosis->effects.size(), 1u) << diagnosis->reason;
    EXPECT_EQ(diagnosis->effects.front().effect.kind, "sensor_drift");
    EXPECT_EQ(diagnosis->effects.front().at, "T2");
}

TEST(Diagnose, FindsAChillerThatAThermostatSwitches) {
    Model truth = small_machine();
    truth.effects.push_back({"coolant_cycling",
                             "thermostat",
                             "housing",
                             {{"power_W", 80.0, 0.0}, {"switch_on_C", 25.0, 0.0}, {"hysteresis_C", 1.0, 0.0}},
                             {}});
    const auto diagnosis = diagnosis_of(truth);
    ASSERT_TRUE(diagnosis.has_value()) << diagnosis.error().message;
    ASSERT_FALSE(diagnosis->effects.empty()) << diagnosis->reason;
    const FoundEffect& found = diagnosis->effects.front();
    EXPECT_EQ(found.effect.kind, "coolant_cycling");
    EXPECT_EQ(found.effect.form, "thermostat");
    EXPECT_EQ(found.at, "housing");
    EXPECT_NEAR(found.effect.parameter("power_W"), 80.0, 12.0);
    EXPECT_NEAR(found.effect.parameter("switch_on_C"), 25.0, 0.2);
    EXPECT_NEAR(found.effect.parameter("hysteresis_C"), 1.0, 0.2);
    ASSERT_TRUE(found.cycle_s.has_value());
}

std::vector<ThermostatSwitching> switchings_of(const Model& model, double minutes) {
    const RecordedTest test = measured_on(model, minutes, 0.0, 1);
    return simulate(model, inputs_of(test), test.time_s).value().switchings;
}

TEST(Diagnose, AChillerDoesNotHideASensorThatDrifts) {
    Model truth = with("sensor_drift", "T3", {{"rate_C_per_h", 0.3, 0.0}});
    truth.effects.push_back(
        {"coolant_cycling",
         "thermostat",
         "housing",
         {{"power_W", 120.0, 0.0}, {"switch_on_C", 25.0, 0.0}, {"hysteresis_C", 1.5, 0.0}},
         {}});
    const auto diagnosis = diagnosis_of(truth);
    ASSERT_TRUE(diagnosis.has_value()) << diagnosis.error().message;
    std::set<std::string> kinds;
    for (const FoundEffect& found : diagnosis->effects) kinds.insert(found.effect.kind);
    EXPECT_EQ(kinds, (std::set<std::string>{"coolant_cycling", "sensor_drift"})) << diagnosis->reason;
    const auto chiller = std::ranges::find_if(
        diagnosis->effects, [](const FoundEffect& found) { return found.effect.kind == "coolant_cycling"; });
    ASSERT_NE(chiller, diagnosis->effects.end());
    EXPECT_EQ(chiller->at, "housing");
    EXPECT_NEAR(chiller->effect.parameter("power_W"), 120.0, 20.0);
    const auto switched = switchings_of(truth, 300.0);
    ASSERT_GT(switched.size(), 20u);
    const double cycle_s = (switched[20].time_s - switched[0].time_s) / 10.0;
    ASSERT_TRUE(chiller->cycle_s.has_value());
    EXPECT_NEAR(*chiller->cycle_s, cycle_s, 0.05 * cycle_s);
    // Every cycle at its moment: one that slips by a quarter of itself leaves a quarter of a degree.
    EXPECT_LT(diagnosis->run.after_rmse_C, 0.1);
}

/// 3 kJ/K where the model's own masses are 3 to 40.
TEST(Diagnose, FindsASmallMassBehindANode) {
    const auto diagnosis =
        diagnosis_of(with("slow_structure", "housing",
                          {{"heat_capacity_J_per_K", 3000.0, 0.0}, {"conductance_W_per_K", 3.0, 0.0}}));
    ASSERT_TRUE(diagnosis.has_value()) << diagnosis.error().message;
    ASSERT_EQ(diagnosis->effects.size(), 1u) << diagnosis->reason;
    const FoundEffect& found = diagnosis->effects.front();
    EXPECT_EQ(found.effect.kind, "slow_structure");
    EXPECT_EQ(found.at, "housing");
    EXPECT_NEAR(found.effect.parameter("heat_capacity_J_per_K"), 3000.0, 600.0);
}

TEST(Diagnose, WritesWhereASensorSitsInItsNode) {
    const auto diagnosis = diagnose(
        with_two_on_the_housing(small_machine(), 0.0),
        measured_on(with_two_on_the_housing(small_machine(), 0.015), 300.0, 0.05, 7), {}, {}, sequential_for);
    ASSERT_TRUE(diagnosis.has_value()) << diagnosis.error().message;
    const auto& sensors = diagnosis->calibrated.sensors;
    EXPECT_NEAR(sensors[1].place_share - sensors[3].place_share, 0.03, 0.004);
    EXPECT_LT(diagnosis->run.before_rmse_C, 0.052);
}

TEST(Diagnose, TheExtendedModelIsAModelAgain) {
    const auto diagnosis =
        diagnosis_of(with("cutting_heat", "bed", {{"power_W", 60.0, 0.0}, {"onset_s", 6000.0, 0.0}}));
    ASSERT_TRUE(diagnosis.has_value());
    EXPECT_TRUE(validate(diagnosis->extended).has_value());
    EXPECT_EQ(diagnosis->extended.effects.size(), diagnosis->effects.size());
}

Diagnosis named_surely(double held_before_C, double held_after_C) {
    Diagnosis diagnosis;
    diagnosis.verdict = GapVerdict::explained;
    diagnosis.effects.emplace_back().probability = 0.96;
    diagnosis.holdouts.resize(1);
    diagnosis.holdouts.front().before_rmse_C = held_before_C;
    diagnosis.holdouts.front().after_rmse_C = held_after_C;
    doubt_what_does_not_carry_over(diagnosis);
    return diagnosis;
}

TEST(Diagnose, ANameThatMakesAHeldOutRunWorseIsDoubtful) {
    const Diagnosis worse = named_surely(0.05, 0.2);
    EXPECT_NEAR(worse.effects.front().probability, 0.06, 1e-9);
    EXPECT_EQ(worse.verdict, GapVerdict::partly_explained);
    EXPECT_NE(worse.reason.find("from 0.050 to 0.200 C"), std::string::npos) << worse.reason;
    const Diagnosis better = named_surely(0.2, 0.05);
    EXPECT_EQ(better.effects.front().probability, 0.96);
    EXPECT_EQ(better.verdict, GapVerdict::explained);
}

RunComparison compared(double before_C, double after_C) {
    RunComparison run;
    run.channels = {"T2"};
    run.measured_C = Eigen::MatrixXd::Constant(1000, 1, 20.0);
    run.before_rmse_C = before_C;
    run.after_rmse_C = after_C;
    run.channel_before_rmse_C = Eigen::VectorXd::Constant(1, before_C);
    run.channel_after_rmse_C = Eigen::VectorXd::Constant(1, after_C);
    return run;
}

Diagnosis withdrawn_if_useless(double after_C, const RunComparison& held,
                               GapVerdict verdict = GapVerdict::explained,
                               const std::string& kind = "sensor_lag") {
    Diagnosis diagnosis;
    diagnosis.verdict = verdict;
    diagnosis.disagreements.resize(1);
    diagnosis.effects.emplace_back().effect.kind = kind;
    diagnosis.effects.back().at = "T2";
    diagnosis.run = compared(0.05, after_C);
    diagnosis.holdouts = {held};
    withdraw_what_closes_no_gap(diagnosis);
    return diagnosis;
}

TEST(Diagnose, AnEffectIsNotNamedToFillAGapThatItDoesNotClose) {
    const Diagnosis useless = withdrawn_if_useless(0.0495, compared(0.05, 0.051));
    EXPECT_TRUE(useless.effects.empty());
    EXPECT_EQ(useless.verdict, GapVerdict::agrees);
    EXPECT_TRUE(useless.disagreements.empty());
    ASSERT_EQ(useless.suspects.size(), 1U);
    EXPECT_EQ(useless.suspects.front().kind, "sensor_lag");
    EXPECT_NE(useless.reason.find("sensor_lag"), std::string::npos) << "a person reads what it was";
    EXPECT_EQ(useless.run.after_rmse_C, 0.05);
    EXPECT_EQ(withdrawn_if_useless(0.045, compared(0.05, 0.051)).effects.size(), 1U)
        << "the run is described better";
    EXPECT_EQ(withdrawn_if_useless(0.05, compared(0.05, 0.045)).effects.size(), 1U) << "the held-out run is";
    EXPECT_EQ(withdrawn_if_useless(0.0484, compared(0.05, 0.0473)).effects.size(), 1U)
        << "half of each is enough";
    EXPECT_TRUE(withdrawn_if_useless(0.045, compared(0.05, 0.06)).effects.empty())
        << "where the held-out run is much worse the run has to be clearer";
    EXPECT_EQ(withdrawn_if_useless(0.04, compared(0.05, 0.06)).effects.size(), 1U);
    RunComparison one_channel_only = compared(0.05, 0.045);
    one_channel_only.after_rmse_C = 0.051;
    EXPECT_TRUE(withdrawn_if_useless(0.05, one_channel_only).effects.empty())
        << "the gap as a whole is larger";
}

TEST(Diagnose, AnEffectOfTheMachineHasToCloseLessThanAnErrorOfASensor) {
    const auto kept = [](double after_C, const std::string& kind) {
        return !withdrawn_if_useless(after_C, compared(0.05, 0.05), GapVerdict::explained, kind)
                    .effects.empty();
    };
    EXPECT_TRUE(kept(0.0492, "slow_structure"));
    EXPECT_FALSE(kept(0.0492, "sensor_lag"));
    EXPECT_FALSE(kept(0.04999, "slow_structure")) << "nothing of the gap";
}

TEST(Diagnose, AnErrorOfASensorHasToShowInItsOwnChannel) {
    const auto kept = [](const std::string& at) {
        Diagnosis diagnosis;
        diagnosis.effects.emplace_back().effect.kind = "sensor_lag";
        diagnosis.effects.back().at = at;
        diagnosis.run = compared(0.05, 0.04);  // of T2
        withdraw_what_closes_no_gap(diagnosis);
        return !diagnosis.effects.empty();
    };
    EXPECT_TRUE(kept("T2"));
    EXPECT_FALSE(kept("T3"));
}

TEST(Diagnose, WhatHasNoNameIsStillThereWhenAUselessNameIsWithdrawn) {
    const Diagnosis useless =
        withdrawn_if_useless(0.0495, compared(0.05, 0.051), GapVerdict::partly_explained);
    EXPECT_TRUE(useless.effects.empty());
    EXPECT_EQ(useless.verdict, GapVerdict::unexplained);
    EXPECT_EQ(useless.disagreements.size(), 1U);
}

TEST(Diagnose, NamesInDoubtThatMakeAHeldOutRunMuchWorseAreNoNames) {
    Diagnosis diagnosis;
    diagnosis.verdict = GapVerdict::partly_explained;
    diagnosis.effects.resize(2);
    for (FoundEffect& found : diagnosis.effects) found.effect.kind = "airflow_change";
    diagnosis.effects.front().in_doubt = diagnosis.effects.back().in_doubt = true;
    diagnosis.run = compared(0.2, 0.05);
    diagnosis.holdouts = {compared(0.2, 0.7)};
    withdraw_what_closes_no_gap(diagnosis);
    EXPECT_EQ(diagnosis.verdict, GapVerdict::unexplained);
    EXPECT_TRUE(diagnosis.effects.empty());
}

}  // namespace
}  // namespace thermbal
