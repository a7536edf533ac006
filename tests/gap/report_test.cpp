#include <gtest/gtest.h>

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
    EXPECT_NE(html.find("a steady heat source that the model lacks, at bed"), std::string::npos);
}

}  // namespace
}  // namespace thermbal
