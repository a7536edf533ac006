#include "odds.hpp"

#include <string>

#include <gtest/gtest.h>

#include "choice.hpp"
#include "network/effect.hpp"
#include "small_machine.hpp"

namespace thermbal {
namespace {

Contender contender_of(const std::string& kind, const std::string& at, double on_the_run, double forecast) {
    const EffectDefinition& definition = *find_effect(kind);
    Contender contender{{&definition, &definition.forms.front(), at}, {}, on_the_run + forecast};
    contender.explanation.log_prediction = forecast;
    return contender;
}

/// Heat that sets in at the housing, in nats over nothing, and no name at some node.
Survey survey_with(double named, double forecast, double nameless, const std::string& node = "housing") {
    Survey survey;
    survey.contenders.push_back(contender_of("cutting_heat", "housing", named, forecast));
    survey.nameless.push_back({false, node, nameless, {}, {}, {}});
    return survey;
}

double probability_named(const Survey& survey) {
    return odds_of(survey, small_machine()).kinds.front().probability;
}

TEST(Odds, WithoutEvidenceNothingIsMissing) {
    const Odds odds = odds_of(survey_with(0.0, 0.0, -2.0), small_machine());
    EXPECT_FALSE(odds.something_is_missing());
}

TEST(Odds, ANameHasToDescribeTheRunAsWellAsNoName) {
    EXPECT_GT(probability_named(survey_with(60.0, 0.0, 50.0)), 0.99);
    EXPECT_LT(probability_named(survey_with(60.0, 0.0, 120.0)), 0.01);
    // A good forecast does not save it.
    EXPECT_LT(probability_named(survey_with(60.0, 90.0, 120.0)), 0.01);
}

/// What a machine of other numbers shows far away is no reason to doubt what a name forecasts here.
TEST(Odds, OnlyWhereItMayBeTheSameCauseNoNameIsCreditedWithAForecast) {
    Model machine = small_machine();
    machine.nodes.push_back({"column", {1000.0, 0.2}});
    machine.links.push_back({"bed", "column", {5.0, 0.2}});
    const auto named = [&](const std::string& nameless_at) {
        return odds_of(survey_with(1.0, 90.0, 25.0, nameless_at), machine).kinds.front().probability;
    };
    EXPECT_LT(named("housing"), 0.01);
    EXPECT_LT(named("bed"), 0.01);
    EXPECT_GT(named("column"), 0.99);
}

/// Where a sensor sits in its node imitates its errors: six nats more than for nothing are not enough.
TEST(Odds, AnErrorOfASensorHasToBePlainerThanAnEffectOfTheMachine) {
    const auto something_is_missing = [](const std::string& kind, const std::string& at, double nats) {
        Survey survey;
        survey.contenders.push_back(contender_of(kind, at, nats, 0.0));
        return odds_of(survey, small_machine()).something_is_missing();
    };
    EXPECT_TRUE(something_is_missing("cutting_heat", "housing", 6.5));
    EXPECT_FALSE(something_is_missing("sensor_lag", "T2", 6.5));
    EXPECT_TRUE(something_is_missing("sensor_lag", "T2", 10.0));
}

TEST(Odds, AKindIsWhereItIsLikeliest) {
    Survey survey = survey_with(10.0, 40.0, -2.0);
    survey.contenders.push_back(contender_of("cutting_heat", "bed", 35.0, 5.0));  // forecasts count half
    const Odds odds = odds_of(survey, small_machine());
    ASSERT_EQ(odds.kinds.size(), 1U);
    EXPECT_EQ(odds.kinds.front().at, "bed");
    EXPECT_EQ(best_of(survey, odds).candidate.at, "bed");
}

TEST(Odds, AreProbabilities) {
    const Odds odds = odds_of(survey_with(5.0, 1.0, 6.0), small_machine());
    EXPECT_NEAR(odds.nothing + odds.nameless + odds.kinds.front().probability, 1.0, 1e-12);
}

TEST(Choose, TakesANameThatIsLikelierThanNothingAndThanNoName) {
    EXPECT_EQ(choose(survey_with(60.0, 0.0, 50.0), small_machine()).support, Support::name);
    EXPECT_EQ(choose(survey_with(1.0, 0.0, -2.0), small_machine()).support, Support::none);
}

TEST(Choose, TakesTheNearestRelativeOfWhatHasNoName) {
    EXPECT_EQ(choose(survey_with(60.0, 0.0, 110.0), small_machine()).support, Support::relative);
    EXPECT_EQ(choose(survey_with(30.0, 0.0, 110.0), small_machine()).support, Support::none);
}

/// Of a pair one forecasts, the other describes the run: the nameless, credited with the forecast, beats
/// both.
TEST(Choose, TakesWhatDescribesTheRunWhereAnotherForecasts) {
    Survey survey = survey_with(4.0, 300.0, 60.0);
    survey.contenders.push_back(contender_of("airflow_change", "bed", 70.0, 5.0));
    const Choice choice = choose(survey, small_machine());
    EXPECT_EQ(choice.support, Support::relative);
    EXPECT_EQ(best_of(survey, choice.odds).candidate.definition->kind, "airflow_change");
    // But not what forecasts worse than nothing.
    survey.contenders.back() = contender_of("airflow_change", "bed", 70.0, -5.0);
    EXPECT_EQ(choose(survey, small_machine()).support, Support::none);
}

/// Further numbers begin where the catalogue expects them.
TEST(Candidates, AFormThatRefinesBeginsWhereTheFirstEnds) {
    const EffectDefinition& kind = *find_effect("sensor_detached");
    Screened first{{&kind, &kind.forms.front(), "T2"},
                   {"sensor_detached", "", "T2", {{"ambient_share", 0.1, 0.0}, {"onset_s", 4000.0, 0.0}}, {}},
                   12.0};
    const auto found = refined(first, small_machine());
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].start.form, "gradual");
    EXPECT_EQ(found[0].start.parameter("ambient_share"), 0.1);
    EXPECT_EQ(found[0].start.parameter("onset_s"), 4000.0);
    EXPECT_EQ(found[0].start.parameter("time_constant_s"), 60.0);
    EXPECT_EQ(found[0].log_likelihood_gain, 12.0);
    first.candidate.form = &kind.forms.back();
    EXPECT_TRUE(refined(first, small_machine()).empty());
}

}  // namespace
}  // namespace thermbal
