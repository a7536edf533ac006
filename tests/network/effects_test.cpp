#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../filter/python_peer.hpp"
#include "config/model_file.hpp"
#include "models.hpp"
#include "network/effect.hpp"

namespace thermbal::testing {
namespace {

/// Every kind in every form, at sizes that move a reading by kelvins.
std::vector<Effect> one_of_each() {
    return {
        {"ambient_drift", "", "", {{"rate_C_per_h", 2.0}, {"onset_s", 700.0}}, {}},
        {"ambient_drift", "wave", "", {{"amplitude_C", 3.0}, {"period_h", 0.8}, {"phase_rad", 0.7}}, {}},
        {"ambient_drift", "column", "T1", {{"share", 0.9}}, {}},
        {"coolant_cycling",
         "",
         "sleeve",
         {{"power_W", 120.0}, {"period_s", 610.0}, {"duty", 0.35}, {"first_on_s", 200.0}},
         {}},
        {"coolant_cycling",
         "thermostat",
         "housing",
         {{"power_W", 260.0}, {"switch_on_C", 22.0}, {"hysteresis_C", 0.6}},
         {}},
        {"friction_viscosity", "", "bearing", {{"beta_per_K", 0.03}, {"reference_C", 22.0}}, {}},
        {"friction_viscosity",
         "viscous_share",
         "bearing",
         {{"viscous_share", 0.7}, {"reference_C", 22.0}},
         {}},
        {"preload_growth", "", "bearing", {{"growth_per_K", 0.08}}, {}},
        {"preload_growth", "to_first_neighbour", "bearing", {{"growth_per_K", 0.07}}, {}},
        {"preload_growth", "to_second_neighbour", "bearing", {{"growth_per_K", 0.06}}, {}},
        {"run_in_heat", "", "bearing", {{"power_W", 60.0}, {"time_constant_s", 1300.0}}, {}},
        {"run_in_heat", "any_speed", "bearing", {{"power_W", 45.0}, {"time_constant_s", 1700.0}}, {}},
        {"motor_heat", "", "housing", {{"power_W", 75.0}}, {}},
        {"cutting_heat", "", "bearing", {{"power_W", 50.0}, {"onset_s", 1717.0}}, {}},
        {"spindle_stop", "", "", {{"duration_s", 905.0}, {"from_s", 2001.0}}, {}},
        {"airflow_change", "", "housing", {{"factor", 2.7}, {"onset_s", 2222.0}}, {}},
        {"surface_nonlinearity", "", "", {{"exponent", 0.33}, {"reference_difference_C", 5.0}}, {}},
        {"slow_structure",
         "",
         "housing",
         {{"heat_capacity_J_per_K", 60000.0}, {"conductance_W_per_K", 9.0}},
         {}},
        {"sensor_lag", "", "T2", {{"time_constant_s", 130.0}}, {}},
        {"sensor_offset", "", "T3", {{"offset_C", -1.3}}, {}},
        {"sensor_drift", "", "T4", {{"rate_C_per_h", 0.9}}, {}},
        {"sensor_detached", "", "T2", {{"ambient_share", 0.45}, {"onset_s", 1111.0}}, {}},
        {"sensor_detached",
         "gradual",
         "T2",
         {{"ambient_share", 0.45}, {"onset_s", 1111.0}, {"time_constant_s", 170.0}},
         {}},
    };
}

std::vector<double> sample_times() {
    return every(60.0, 6000.0);
}

/// The bearing sits between two nodes, as preload that grows with the difference to one of them needs it.
Model with(std::vector<Effect> effects) {
    Model model = spindle_head();
    add_link(model, "bearing", "motor", 4.0);
    model.effects = std::move(effects);
    return model;
}

std::string run_table(const Inputs& inputs) {
    std::string text = fmt::format("\n[run]\ntime_s = {}\nsample_s = {}\n", inputs.time_s, sample_times());
    for (const Column& column : inputs.columns) text += fmt::format("{} = {}\n", column.name, column.values);
    text += "[run.first]\n";
    for (const auto& first : inputs.first_readings)
        text += fmt::format("{} = {}\n", first.channel, first.value_C);
    return text;
}

/// The cases: each effect alone, then all at once in their first form; the reference answers all in one go.
struct Cases {
    std::vector<Model> models;
    std::vector<Numbers> expected;
};
const Cases& cases() {
    static const Cases all = [] {
        Cases made;
        std::vector<Effect> together;
        for (const Effect& effect : one_of_each()) {
            made.models.push_back(with({effect}));
            if (effect.form.empty()) together.push_back(effect);
        }
        made.models.push_back(with(together));
        std::string requests;
        for (const Model& model : made.models) {
            requests += (requests.empty() ? "" : "%%%\n") + write_model(model) + run_table(spindle_inputs());
        }
        made.expected = ask_python("network/reference.py", requests);
        return made;
    }();
    return all;
}

class EveryEffect : public ::testing::TestWithParam<std::size_t> {};

TEST_P(EveryEffect, ReadsAsAnotherImplementationSays) {
    ASSERT_EQ(cases().expected.size(), cases().models.size());
    const Model& model = cases().models[GetParam()];
    const Numbers& expected = cases().expected[GetParam()];
    const auto times = sample_times();
    const auto simulation = simulate(model, spindle_inputs(), times);
    ASSERT_TRUE(simulation) << simulation.error().message;
    const auto plain = simulate(with({}), spindle_inputs(), times);
    ASSERT_EQ(expected.size(), times.size() * model.sensors.size());
    double worst = 0.0;
    for (std::size_t k = 0; k < expected.size(); ++k) {
        const auto row = static_cast<Eigen::Index>(k / model.sensors.size());
        const auto column = static_cast<Eigen::Index>(k % model.sensors.size());
        worst = std::max(worst, std::abs(simulation->reading_C(row, column) - expected[k]));
    }
    EXPECT_LT(worst, 1e-3);
    EXPECT_GT((simulation->reading_C - plain->reading_C).lpNorm<Eigen::Infinity>(), 0.5)
        << "an effect that moves nothing proves nothing";
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EveryEffect, ::testing::Range(std::size_t{0}, one_of_each().size() + 1),
                         [](const ::testing::TestParamInfo<std::size_t>& chosen) {
                             const auto effects = one_of_each();
                             if (chosen.param >= effects.size()) return std::string("all_at_once");
                             const Effect& effect = effects[chosen.param];
                             return effect.kind + (effect.form.empty() ? "" : "_" + effect.form);
                         });

TEST(Catalogue, HasTheFifteenKindsEachWithAllThatAPersonHasToKnow) {
    const std::vector<std::string> kinds = {
        "ambient_drift",  "coolant_cycling", "friction_viscosity", "preload_growth", "run_in_heat",
        "motor_heat",     "cutting_heat",    "spindle_stop",       "airflow_change", "surface_nonlinearity",
        "slow_structure", "sensor_lag",      "sensor_offset",      "sensor_drift",   "sensor_detached"};
    std::vector<std::string> found;
    for (const EffectDefinition& definition : effect_catalogue()) {
        found.push_back(definition.kind);
        EXPECT_FALSE(definition.summary.empty() || definition.where.empty() || definition.source.empty() ||
                     definition.told_apart_by.empty())
            << definition.kind;
        for (const std::string& other : definition.look_alikes) {
            EXPECT_NE(find_effect(other), nullptr) << definition.kind << " looks like " << other;
        }
        const auto tested = one_of_each();
        for (const EffectForm& form : definition.forms) {
            EXPECT_TRUE(std::ranges::any_of(tested,
                                            [&](const Effect& effect) {
                                                return effect.kind == definition.kind &&
                                                       &definition.form_of(effect) == &form;
                                            }))
                << definition.kind << ", form " << form.name << " is not tested";
        }
    }
    EXPECT_THAT(found, ::testing::ContainerEq(kinds));
}

TEST(Catalogue, AnEffectShowsAtTheNodeOfItsSourceOrSensor) {
    Model model = spindle_head();
    model.sources.front().name = "friction";
    EXPECT_EQ(node_of_place(EffectSite::source, "friction", model), model.sources.front().node);
    EXPECT_EQ(node_of_place(EffectSite::channel, "T2", model), model.sensors[*find_sensor(model, "T2")].node);
    EXPECT_EQ(node_of_place(EffectSite::ambient_link, "housing", model), "housing");
    EXPECT_EQ(node_of_place(EffectSite::whole_model, "", model), "");
}

TEST(Catalogue, PriorsLieInsideTheirBoundsAndMakeAValidEffect) {
    const Model model = spindle_head();
    for (const EffectDefinition& definition : effect_catalogue()) {
        for (const EffectForm& form : definition.forms) {
            for (const EffectParameterDefinition& parameter : form.parameters) {
                const ResolvedPrior prior = resolve_prior(parameter, model);
                EXPECT_LT(prior.lower, prior.upper) << parameter.name;
                EXPECT_GE(prior.centre, prior.lower) << parameter.name;
                EXPECT_LE(prior.centre, prior.upper) << parameter.name;
                EXPECT_TRUE(!prior.logarithmic || prior.lower > 0.0) << parameter.name;
            }
            const auto places = form.site == EffectSite::column ? std::vector<std::string>{"T1"}
                                                                : possible_places(form, model);
            ASSERT_FALSE(places.empty()) << definition.kind;
            for (const std::string& place : places) {
                Model extended = model;
                extended.effects = {make_effect(definition, form, place, model)};
                EXPECT_TRUE(validate(extended)) << definition.kind << " at " << place;
            }
        }
    }
}

}  // namespace
}  // namespace thermbal::testing
