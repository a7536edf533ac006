#include <gtest/gtest.h>

#include "quantity.hpp"
#include "report/diagnosis_json.hpp"
#include "report/gap_report.hpp"

namespace thermbal {
namespace {

Diagnosis some_diagnosis() {
    Diagnosis diagnosis;
    diagnosis.verdict = GapVerdict::explained;
    diagnosis.run = {.name = "a<b>.csv",
                     .time_s = {0.0, 60.0},
                     .channels = {"T1"},
                     .measured_C = Eigen::MatrixXd::Constant(2, 1, 20.0),
                     .before_C = Eigen::MatrixXd::Constant(2, 1, 21.0),
                     .after_C = Eigen::MatrixXd::Constant(2, 1, 20.1),
                     .before_rmse_C = 1.0,
                     .after_rmse_C = 0.1,
                     .channel_before_rmse_C = Eigen::VectorXd::Constant(1, 1.0),
                     .channel_after_rmse_C = Eigen::VectorXd::Constant(1, 0.1)};
    FoundEffect found;
    found.effect = {"motor_heat", "", "bed", {{"power_W", 40.0, 0.1}}, {}};
    found.at = "bed";
    found.probability = 0.9;
    Parameter power{.name = "motor_heat(bed).power_W", .value = 40.0, .lower = 0.1, .upper = 1e3};
    found.parameters.push_back({power, 40.0, 0.1, false});
    found.alternatives.push_back({"sensor_offset", "T1", 0.08, 1.0});
    found.alternatives.push_back({"cutting_heat", "bed", 0.05, 0.5});
    found.experiments.push_back({.against = "sensor_offset",
                                 .against_at = "T1",
                                 .kind = SeparatingExperiment::Kind::cool_down,
                                 .channel = "T2",
                                 .difference_C = 0.75,
                                 .sigmas = 30.0,
                                 .separates = true});
    found.experiments.push_back({.against = "sensor_offset", .against_at = "T1", .channel = "T1"});
    found.experiments.push_back({.against = "cutting_heat", .against_at = "bed", .channel = "T1"});
    diagnosis.effects.push_back(found);
    return diagnosis;
}

TEST(DiagnosisJson, HasTheFieldsOfTheInterface) {
    const auto json = diagnosis_to_json(some_diagnosis());
    EXPECT_EQ(json.at("verdict"), "explained");
    EXPECT_DOUBLE_EQ(json.at("gap").at("before_rmse_C"), 1.0);
    EXPECT_TRUE(json.at("gap").at("holdout_before_rmse_C").is_null());
    const auto& effect = json.at("effects").at(0);
    EXPECT_EQ(effect.at("kind"), "motor_heat");
    EXPECT_EQ(effect.at("at"), "bed");
    EXPECT_DOUBLE_EQ(effect.at("parameters").at("power_W"), 40.0);
    EXPECT_LT(effect.at("parameters_90_percent").at("power_W").at(0), 40.0);
    EXPECT_EQ(effect.at("alternatives").at(0).at("kind"), "sensor_offset");
    const auto& experiment = effect.at("separating_experiments").at(0);
    EXPECT_EQ(experiment.at("against"), "sensor_offset");
    EXPECT_EQ(experiment.at("kind"), "cool_down");
    EXPECT_EQ(experiment.at("channel"), "T2");
    EXPECT_TRUE(experiment.at("separates").get<bool>());
}

TEST(GapReport, NeedsNothingElseAndEscapesNames) {
    const std::string html = gap_report_html(some_diagnosis());
    EXPECT_EQ(html.find("<b>.csv"), std::string::npos);
    EXPECT_NE(html.find("a&lt;b&gt;.csv"), std::string::npos);
    for (const char* outside : {"<script src", "<link", "<img", "@import", "url(", "sourceMappingURL"})
        EXPECT_EQ(html.find(outside), std::string::npos);
    EXPECT_NE(html.find("<svg"), std::string::npos);
    EXPECT_NE(html.find("data-plot=\"run0-0\""), std::string::npos);
    EXPECT_NE(html.find("\"T1 after\":[20.1,20.1]"), std::string::npos);
    EXPECT_NE(html.find("A steady heat source that the model lacks, at bed: power 40 W ("),
              std::string::npos);
}

TEST(GapReport, SaysInPlainWordsWhatWouldSettleIt) {
    const std::string html = gap_report_html(some_diagnosis());
    EXPECT_NE(
        html.find("a sensor reads a constant too much, at T1</q>: a run at constant speed whose spindle is "
                  "stopped half way"),
        std::string::npos);
    EXPECT_NE(html.find("T2 would read 0.75 &deg;C otherwise"), std::string::npos);
    EXPECT_NE(html.find("stays, at bed</q>: no cool-down, second speed"), std::string::npos);
    std::size_t listed = 0;  // only the clearest of each alternative
    for (std::size_t at = html.find("<li>Against"); at != std::string::npos;
         at = html.find("<li>Against", at + 1))
        ++listed;
    EXPECT_EQ(listed, 2u);
}

TEST(GapReport, SaysNumbersWithUnitsThatAPersonReads) {
    EXPECT_EQ(quantity_in_words("power_W", 41.02, 38.1, 43.93), "power 41 W (38.1 to 43.9)");
    EXPECT_EQ(quantity_in_words("onset_s", 20000.0, 19980.0, 20100.0), "onset 333 min (333 to 335)");
    EXPECT_EQ(quantity_in_words("time_constant_s", 45.0, 40.0, 50.0), "time constant 45 s (40 to 50)");
    EXPECT_EQ(quantity_in_words("heat_capacity_J_per_K", 23456.7, 2e4, 3e4),
              "heat capacity 23457 J/K (20000 to 30000)");
    EXPECT_EQ(quantity_in_words("beta_per_K", 0.0123, 0.01, 0.015), "beta 0.0123 1/K (0.01 to 0.015)");
    EXPECT_EQ(quantity_in_words("factor", 1.5, 1.4, 1.6), "factor 1.5 (1.4 to 1.6)");
}

}  // namespace
}  // namespace thermbal
