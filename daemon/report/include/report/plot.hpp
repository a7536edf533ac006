#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "series/recorded_test.hpp"

namespace thermbal {

/// Columns over one common x. NaN is a value that is not there.
struct PlotTable {
    std::string name;
    std::string x_label;  ///< the unit of x: "min", "h", or "n"
    std::vector<double> x;
    std::vector<Column> columns;  ///< each as long as x

    const Column* column(std::string_view column_name) const;
};

/// At most 2 * `pixels` rows: each run of neighbouring rows that shares a pixel becomes two rows in which
/// every column has its smallest and its largest value of the run, in the order in which they came. Nothing
/// that sticks out is lost, nothing is averaged; a time is off by less than a pixel. A table that is short
/// enough stays as it is.
PlotTable thinned(PlotTable table, std::size_t pixels);
inline constexpr std::size_t pixels_of_a_screen = 1000;

/// Computed temperatures to 0.0001 C: no estimate knows more, and digits that say nothing make a file large.
double rounded(double value_C);
std::vector<double> rounded(std::vector<double> values_C);

/// "min" and 60 for a plot over `span_s`, "h" and 3600 for one over more than 10 hours.
std::pair<std::string, double> time_unit(double span_s);

/// Names of the page's colours: "ink", "muted", "accent", "c1" ... "c7". They differ in a light and a dark
/// scheme and in print.
using PlotColour = std::string;

struct PlotLine {
    enum class Stroke { solid, dashed, dots };
    std::string label;
    std::string column;
    PlotColour colour = "ink";
    Stroke stroke = Stroke::solid;
};

/// Between two columns.
struct PlotBand {
    std::string low, high;
    PlotColour colour = "accent";
};

/// A rectangle from one x to another, infinite to the plot's edge.
struct PlotStrip {
    double from_x, to_x, low, high;
    PlotColour colour = "accent";
};

struct PlotMark {
    double x;
    std::string label;
};

/// One plot: drawn by dygraphs where a script may run, and as a still SVG on paper and where none may.
struct Plot {
    std::string id;  ///< unique in the page: letters, digits, dashes
    std::string title;
    std::string table;
    std::string unit;  ///< of y
    std::vector<PlotLine> lines;
    std::vector<PlotBand> bands = {};
    std::vector<PlotStrip> strips = {};
    std::vector<PlotMark> marks = {};
    std::optional<std::pair<double, double>> range = {};  ///< of y; without it all of the lines and strips
    int height_px = 220;
    bool label_lines = false;  ///< at their right ends, instead of a key above the plot
};

/// What y spans: `range`, or all values with a margin.
std::pair<double, double> value_range(const Plot& plot, const PlotTable& table);

/// The still picture. `standalone`: a file of its own with its own colours; otherwise part of a page.
std::string svg_plot(const Plot& plot, const PlotTable& table, bool standalone = false);

}  // namespace thermbal
