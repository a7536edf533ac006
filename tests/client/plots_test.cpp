#include "plots.hpp"

#include <gtest/gtest.h>

#include "columns.hpp"
#include "fields.hpp"
#include "scenes.hpp"

namespace thermbal::test {
namespace {

using nlohmann::json;

class Plots : public ::testing::Test {
  protected:
    void SetUp() override { use_utf8(); }
};

TEST_F(Plots, ASparklineRisesWithItsValuesAndLeavesMissingOnesBlank) {
    EXPECT_EQ(sparkline(json{0, 1, 2, 3, nullptr, 5, 6, 7}, 8, true), "▁▂▃▄ ▆▇█");
    EXPECT_EQ(sparkline(json{0, 1, 2, 3, nullptr, 5, 6, 7}, 8, false), "_.,- +*#");
}

TEST_F(Plots, ASparklineIsThinnedOverItsWholeLengthAndFilledUp) {
    EXPECT_EQ(sparkline(json{0, 0, 7, 7}, 2, true), "▁█");
    EXPECT_EQ(sparkline(json{0, 7}, 4, true), "  ▁█");
    EXPECT_EQ(sparkline(json(), 3, true), "   ");
    EXPECT_EQ(sparkline(json{nullptr, "x"}, 3, true), "   ");
}

TEST_F(Plots, NoiseOfATenthDoesNotFillTheScale) {
    EXPECT_EQ(sparkline(json{20.0, 20.1, 20.0}, 3, true), "▄▅▄");
    EXPECT_EQ(sparkline(json{20.0, 20.0}, 2, true), "▅▅");
}

TEST_F(Plots, TheCurveMarksMinimumAndChoice) {
    const json curve = {{"channel", "T5"}, {"n", 2}, {"rmse_by_n_C", {0.4, 0.25, nullptr, 0.2}}};
    EXPECT_EQ(curve_plot(curve, 43, false),
              "T5: RMSE against n\n"
              " n     RMSE\n"
              " 1  0.400 C  ##########\n"
              " 2  0.250 C  ######  <- chosen\n"
              " 3  -\n"
              " 4  0.200 C  #####  <- minimum\n");
}

TEST_F(Plots, ACurveThatWasNotSweptSaysSo) {
    EXPECT_EQ(curve_plot({{"channel", "T5"}, {"rmse_by_n_C", json::array()}}, 80, true),
              "T5: RMSE against n\nnot swept on this window yet\n");
    EXPECT_NE(curve_plot(json("nonsense"), 80, true).find("not swept"), std::string::npos);
}

TEST_F(Plots, FiguresOfAnotherKindAreNone) {
    const json odd = {{"a", "text"}, {"b", nullptr}, {"c", 1.25}};
    EXPECT_EQ(fixed(number(odd, "a"), 2), "-");
    EXPECT_EQ(fixed(number(odd, "c"), 1), "1.2");
    EXPECT_EQ(with_sign(-0.004, 2), "+0.00");
    EXPECT_EQ(with_sign(-0.006, 2), "-0.01");
    EXPECT_EQ(minutes(999.4), "999 min");
    EXPECT_EQ(minutes(1200.0), "20.0 h");
    EXPECT_TRUE(list(odd, "c").empty());
    EXPECT_TRUE(text(json::array(), "c").empty());
}

}  // namespace
}  // namespace thermbal::test
