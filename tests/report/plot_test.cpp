#include "report/plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();

PlotTable noisy(std::size_t rows) {
    PlotTable table{"t", "min", {}, {{"a", {}}, {"b", {}}}};
    for (std::size_t i = 0; i < rows; ++i) {
        table.x.push_back(static_cast<double>(i));
        table.columns[0].values.push_back(std::sin(static_cast<double>(i) * 0.7) + (i == 4321 ? 50.0 : 0.0));
        table.columns[1].values.push_back(i < rows / 2 ? none : -std::cos(static_cast<double>(i) * 0.3));
    }
    return table;
}

TEST(Thinned, LeavesAShortTableAsItIs) {
    const PlotTable table = noisy(200);
    EXPECT_EQ(thinned(table, 100).x, table.x);
}

// Against the definition, by brute force: every run of rows keeps its smallest and its largest value, in
// their order.
TEST(Thinned, KeepsTheExtremesOfEveryRunInTheirOrder) {
    const PlotTable table = noisy(10'000);
    constexpr std::size_t pixels = 100, run = 100;
    const PlotTable thin = thinned(table, pixels);
    ASSERT_EQ(thin.x.size(), 2 * pixels);
    EXPECT_TRUE(std::ranges::is_sorted(thin.x));
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        const auto from = table.columns[0].values.begin() + static_cast<std::ptrdiff_t>(pixel * run);
        const auto [low, high] = std::minmax_element(from, from + run);
        const double first = thin.columns[0].values[2 * pixel],
                     second = thin.columns[0].values[2 * pixel + 1];
        EXPECT_EQ(first, low < high ? *low : *high);
        EXPECT_EQ(second, low < high ? *high : *low);
        EXPECT_GE(thin.x[2 * pixel], table.x[pixel * run]);
        EXPECT_LE(thin.x[2 * pixel + 1], table.x[pixel * run + run - 1]);
    }
}

TEST(Thinned, InventsNothingWhereThereIsNothing) {
    const PlotTable thin = thinned(noisy(10'000), 100);
    for (std::size_t row = 0; row < 100; ++row) EXPECT_TRUE(std::isnan(thin.columns[1].values[row]));
    for (std::size_t row = 100; row < 200; ++row) EXPECT_TRUE(std::isfinite(thin.columns[1].values[row]));
}

TEST(ValueRange, HoldsLinesAndStripsWithAMargin) {
    PlotTable table{"t", "min", {0.0, 1.0, 2.0}, {{"a", {20.0, none, 30.0}}}};
    const Plot plot{.id = "p",
                    .title = "",
                    .table = "t",
                    .unit = "C",
                    .lines = {{"a", "a"}},
                    .strips = {{0.0, 1.0, 29.0, 33.0}}};
    const auto [low, high] = value_range(plot, table);
    EXPECT_LT(low, 20.0);
    EXPECT_GT(high, 33.0);
    EXPECT_LT(high, 36.0);
    const Plot nothing{.id = "p", .title = "", .table = "t", .unit = "C", .lines = {{"b", "b"}}};
    EXPECT_LT(value_range(nothing, table).first, value_range(nothing, table).second);
}

TEST(SvgPlot, DrawsWhatIsThereAndEscapesNames) {
    PlotTable table{"t", "min", {0.0, 1.0, 2.0, 3.0}, {{"a", {1.0, 2.0, none, 4.0}}}};
    const Plot plot{.id = "p",
                    .title = "<script>",
                    .table = "t",
                    .unit = "C",
                    .lines = {{"</text><b>", "a"}, {"gone", "b"}},
                    .label_lines = true};
    const std::string svg = svg_plot(plot, table, true);
    EXPECT_EQ(svg.find("<script>"), std::string::npos);
    EXPECT_EQ(svg.find("<b>"), std::string::npos);
    EXPECT_NE(svg.find("&lt;/text&gt;"), std::string::npos);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
}

}  // namespace
}  // namespace thermbal
