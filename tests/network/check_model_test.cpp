#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models.hpp"

namespace thermbal::testing {
namespace {

using ::testing::HasSubstr;

struct Mistaken {
    const char* name;
    std::function<void(Model&)> make;
    ModelPlace::Table table;
    std::size_t index;
    const char* key;
    const char* text;
};

class ModelMistakes : public ::testing::TestWithParam<Mistaken> {};

TEST_P(ModelMistakes, AreFoundWhereTheyAre) {
    Model model = spindle_head();
    ASSERT_TRUE(check_model(model).empty());
    GetParam().make(model);
    const auto mistakes = check_model(model);
    ASSERT_FALSE(mistakes.empty());
    EXPECT_EQ(mistakes[0].place.table, GetParam().table);
    EXPECT_EQ(mistakes[0].place.index, GetParam().index);
    EXPECT_EQ(mistakes[0].place.key, GetParam().key);
    EXPECT_THAT(mistakes[0].text, HasSubstr(GetParam().text));
    const auto valid = validate(model);
    ASSERT_FALSE(valid);
    EXPECT_EQ(valid.error().next, NextStep::refuse_input);
}

using Table = ModelPlace::Table;
constexpr double none = std::numeric_limits<double>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    All, ModelMistakes,
    ::testing::Values(
        Mistaken{"node_twice", [](Model& m) { m.nodes[1].name = "bearing"; }, Table::node, 1, "name",
                 "already"},
        Mistaken{"node_called_ambient", [](Model& m) { add_node(m, "ambient", 1.0); }, Table::node, 4, "name",
                 "another name"},
        Mistaken{"no_capacity", [](Model& m) { m.nodes[2].heat_capacity_J_per_K.value = 0.0; }, Table::node,
                 2, "heat_capacity_J_per_K", "positive"},
        Mistaken{"capacity_nan", [](Model& m) { m.nodes[2].heat_capacity_J_per_K.value = none; }, Table::node,
                 2, "heat_capacity_J_per_K", "positive"},
        Mistaken{"unknown_node", [](Model& m) { m.links[1].b = "hosing"; }, Table::link, 1, "between",
                 "\"housing\""},
        Mistaken{"link_to_itself", [](Model& m) { m.links[0].b = "bearing"; }, Table::link, 0, "between",
                 "twice"},
        Mistaken{"link_twice", [](Model& m) { add_link(m, "sleeve", "bearing", 1.0); }, Table::link, 6,
                 "between", "linked already"},
        Mistaken{"negative_conductance", [](Model& m) { m.links[3].conductance_W_per_K.value = -1.0; },
                 Table::link, 3, "conductance_W_per_K", "positive"},
        Mistaken{"an_island", [](Model& m) { add_node(m, "island", 1.0); }, Table::node, 4, "name",
                 "ambient"},
        Mistaken{"source_on_the_air", [](Model& m) { m.sources[0].node = "ambient"; }, Table::source, 0,
                 "node", "accepted"},
        Mistaken{"reference_zero", [](Model& m) { m.sources[0].reference = 0.0; }, Table::source, 0,
                 "reference", "other than 0"},
        Mistaken{"channel_twice", [](Model& m) { add_sensor(m, "T2", "motor"); }, Table::sensor, 4, "channel",
                 "already"},
        Mistaken{"no_noise", [](Model& m) { m.sensors[1].noise_C = 0.0; }, Table::sensor, 1, "noise_C",
                 "positive"},
        Mistaken{"sigma", [](Model& m) { m.links[0].conductance_W_per_K.relative_sigma = -0.1; }, Table::link,
                 0, "conductance_W_per_K", "relative_sigma"},
        Mistaken{"unknown_kind", [](Model& m) { m.effects = {{"friction", "", "bearing", {}, {}}}; },
                 Table::effect, 0, "kind", "friction_viscosity"},
        Mistaken{"unknown_form",
                 [](Model& m) { m.effects = {{"coolant_cycling", "sine", "sleeve", {}, {}}}; }, Table::effect,
                 0, "form", "thermostat"},
        Mistaken{"effect_nowhere",
                 [](Model& m) {
                     m.effects = {{"airflow_change", "", "sleeve", {{"factor", 2}, {"onset_s", 5}}, {}}};
                 },
                 Table::effect, 0, "link", "\"housing\""},
        Mistaken{"parameter_missing",
                 [](Model& m) { m.effects = {{"cutting_heat", "", "sleeve", {{"power_W", 5.0}}, {}}}; },
                 Table::effect, 0, "onset_s", "missing"},
        Mistaken{"parameter_negative",
                 [](Model& m) { m.effects = {{"motor_heat", "", "sleeve", {{"power_W", -5.0}}, {}}}; },
                 Table::effect, 0, "power_W", "positive"},
        Mistaken{"share_beyond_one",
                 [](Model& m) {
                     m.effects = {
                         {"sensor_detached", "", "T2", {{"ambient_share", 1.5}, {"onset_s", 60}}, {}}};
                 },
                 Table::effect, 0, "ambient_share", "0 to 1"},
        Mistaken{"more_switchings_than_a_computer_holds",
                 [](Model& m) {
                     m.effects = {
                         {"coolant_cycling", "", "sleeve", {{"power_W", 5.0}, {"period_s", 1e-6}}, {}}};
                 },
                 Table::effect, 0, "period_s", "10 or more"},
        Mistaken{"parameter_unknown",
                 [](Model& m) {
                     m.effects = {{"motor_heat", "", "sleeve", {{"power_W", 5.0}, {"onset_s", 5}}, {}}};
                 },
                 Table::effect, 0, "onset_s", "not a parameter"}),
    [](const ::testing::TestParamInfo<Mistaken>& chosen) { return std::string(chosen.param.name); });

}  // namespace
}  // namespace thermbal::testing
