#include "config/model_file.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "models.hpp"

namespace thermbal::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
namespace fs = std::filesystem;

constexpr char good[] = R"([model]
name = "head"
ambient_C = 18.0
relative_sigma = 0.3

[[node]]
name = "front_bearing"
heat_capacity_J_per_K = { value = 4200, relative_sigma = 0.1 }

[[link]]
between = ["front_bearing", "ambient"]
conductance_W_per_K = 9.5

[[source]]
node = "front_bearing"
power_W = 95.0
proportional_to = "spindle_rpm"
reference = 5000.0

[[sensor]]
channel = "T3"
node = "front_bearing"
noise_C = 0.06
)";

std::string with(std::string_view from, std::string_view to) {
    std::string text = good;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

std::string refusal(const std::string& text) {
    const auto model = load_model(text, "m.toml");
    EXPECT_FALSE(model);
    if (model) return "";
    EXPECT_EQ(model.error().next, NextStep::refuse_input);
    return model.error().message;
}

TEST(ModelOfATest, AsksForColumnsThatTheTestHas) {
    const TestColumns columns{{"T1", "T3"}, {"spindle_rpm"}};
    EXPECT_TRUE(load_model(good, "m.toml", columns));
    EXPECT_TRUE(load_model(with("18.0", "\"T1\""), "m.toml", columns));
    const auto message = [&](std::string_view from, std::string_view to) {
        const auto refused = load_model(with(from, to), "m.toml", columns);
        return refused ? std::string() : refused.error().message;
    };
    EXPECT_THAT(message("18.0", "\"T2\""), StartsWith("m.toml:3:13: model.ambient_C: found \"T2\""));
    EXPECT_THAT(
        message("\"spindle_rpm\"", "\"rpm\""),
        StartsWith("m.toml:17:19: source.proportional_to: found \"rpm\"; the test has no such input"));
    EXPECT_THAT(message("\"T3\"", "\"T4\""), HasSubstr("no [[sensor]] is a channel of the test"));
}

TEST(ModelFile, GivesTheModelThatIsWritten) {
    const auto model = load_model(good, "m.toml");
    ASSERT_TRUE(model) << model.error().message;
    EXPECT_EQ(model->name, "head");
    EXPECT_EQ(model->ambient.value_C, 18.0);
    EXPECT_EQ(model->nodes[0].heat_capacity_J_per_K.value, 4200.0);
    EXPECT_EQ(model->nodes[0].heat_capacity_J_per_K.relative_sigma, 0.1);
    EXPECT_EQ(model->links[0].conductance_W_per_K.relative_sigma, 0.3);
    EXPECT_EQ(model->sources[0].name, "front_bearing");
    EXPECT_EQ(model->sources[0].exponent.value, 1.0);
    EXPECT_EQ(model->sensors[0].noise_C, 0.06);
    EXPECT_EQ(load_model(with("18.0", "\"T1\""), "m.toml")->ambient.column, "T1");
}

TEST(ModelFile, SourcesOnOneNodeGetNamesOfTheirOwn) {
    const auto model =
        load_model(std::string(good) + "[[source]]\nnode = \"front_bearing\"\npower_W = 5\n", "m.toml");
    ASSERT_TRUE(model) << model.error().message;
    EXPECT_EQ(model->sources[1].name, "front_bearing 2");
}

TEST(ModelFile, SaysEveryMistakeWithLineAndColumn) {
    EXPECT_THAT(refusal(with("4200", "-1")), HasSubstr("m.toml:8:35: heat_capacity_J_per_K.value: found -1"));
    EXPECT_THAT(refusal(with("[\"front_bearing\", \"ambient\"]", "[\"front\", \"ambient\"]")),
                StartsWith("m.toml:11:11: link.between: no node is called \"front\""));
    EXPECT_THAT(refusal(with("conductance_W_per_K", "conductance")),
                HasSubstr("m.toml:12:1: link.conductance"));
    EXPECT_THAT(refusal(with("noise_C = 0.06", "noise_C = \"low\"")),
                StartsWith("m.toml:23:11: sensor.noise_C"));
    EXPECT_THAT(refusal(std::string(good) + "place_share = 0.7\n"),
                StartsWith("m.toml:24:15: sensor.place_share: found 0.7"));
    EXPECT_THAT(refusal(with("reference = 5000.0\n", "")),
                StartsWith("m.toml:14:1: source.reference: is missing"));
    EXPECT_THAT(refusal(with("[model]", "[modle]")), HasSubstr("did you mean model?"));
    EXPECT_THAT(refusal(with("18.0", "18.0 C")), StartsWith("m.toml:3:"));
    EXPECT_THAT(
        refusal(std::string(good) + "[[effect]]\nkind = \"motor_heat\"\nnode = \"rear\"\npower_W = 5\n"),
        StartsWith("m.toml:26:8: effect.node: found \"rear\"; accepted: \"front_bearing\""));
    EXPECT_THAT(refusal(std::string(good) + "[[effect]]\nkind = \"motor\"\nnode = \"x\"\n"),
                StartsWith("m.toml:25:8: effect.kind: found \"motor\""));
    EXPECT_THAT(refusal(""), HasSubstr("model: is missing"));
}

TEST(ModelFile, WhatIsWrittenReadsBackToTheSame) {
    Model model = spindle_head();
    model.name = "a \"quoted\" name";
    model.ambient = {"", 19.3, 0.25};
    model.nodes[2].heat_capacity_J_per_K = {1.0 / 3.0, 0.123456789};
    model.sources[0].exponent = {1.3, 0.2};
    model.sensors[1].place_share = -0.0123;
    model.effects = {
        {"coolant_cycling",
         "thermostat",
         "housing",
         {{"power_W", 260.0, 12.0}, {"switch_on_C", 22.0, 0.1}, {"hysteresis_C", 0.6}},
         {"x.csv", 0.97, "by diagnose"}},
        {"airflow_change", "", "motor", {{"factor", 2.0}, {"onset_s", 1e-7}}, {}},
        {"spindle_stop", "", "", {{"duration_s", 905.0}, {"from_s", 2001.0}}, {}},
    };
    const std::string text = write_model(model, "calibrated\non x.csv");
    EXPECT_THAT(text, StartsWith("# calibrated\n# on x.csv\n[model]\n"));
    const auto back = load_model(text, "m.toml");
    ASSERT_TRUE(back) << back.error().message << "\n" << text;
    EXPECT_EQ(write_model(*back, "calibrated\non x.csv"), text);
    EXPECT_EQ(back->nodes[2].heat_capacity_J_per_K.value, 1.0 / 3.0);
    EXPECT_EQ(back->ambient.sigma_C, 0.25);
    EXPECT_EQ(back->sensors[1].place_share, -0.0123);
    EXPECT_EQ(back->sensors[2].place_share, 0.0);
    EXPECT_EQ(back->effects[0].parameters[0].sigma, 12.0);
    EXPECT_EQ(back->effects[0].provenance.probability, 0.97);
    EXPECT_EQ(back->effects[1].at, "motor");
}

TEST(ModelFile, TheTemplatesAreGoodModels) {
    int seen = 0;
    for (const auto& entry : fs::directory_iterator(std::string(THERMBAL_SOURCE_DIR) + "/config/models")) {
        if (entry.path().extension() != ".toml") continue;
        ++seen;
        std::stringstream text;
        text << std::ifstream(entry.path()).rdbuf();
        const auto model = load_model(text.str(), entry.path().filename().string());
        ASSERT_TRUE(model) << model.error().message;
        EXPECT_EQ(model->sensors.size(), 16U) << entry.path();
        EXPECT_EQ(model->sensors[0].channel, "T1");
        EXPECT_EQ(model->sensors[0].node, ambient_node);
        // At 5000 rpm the bearings settle where those of such spindles do.
        Inputs inputs;
        inputs.time_s = {0.0};
        inputs.columns = {{"spindle_rpm", {5000.0}}, {"T1", {20.0}}};
        const std::vector<double> times = {0.0, 400.0 * 60.0};
        const auto simulation = simulate(*model, inputs, times);
        ASSERT_TRUE(simulation) << simulation.error().message;
        const Eigen::RowVectorXd rise = simulation->reading_C.row(1).tail(15).array() - 20.0;
        EXPECT_GT(rise.minCoeff(), 0.3) << entry.path();
        EXPECT_GT(rise.maxCoeff(), 10.0) << entry.path();
        EXPECT_LT(rise.maxCoeff(), 35.0) << entry.path();
    }
    EXPECT_EQ(seen, 2);
}

}  // namespace
}  // namespace thermbal::testing
