#include "report/plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "series/sample.hpp"

namespace thermbal {
namespace {

/// The smallest and the largest of a run of values, in the order in which they came; NaN without any.
std::pair<double, double> extremes_in_order(const std::vector<double>& values, std::size_t from,
                                            std::size_t to) {
    std::size_t low = to, high = to;
    for (std::size_t i = from; i < to; ++i) {
        if (!std::isfinite(values[i])) continue;
        if (low == to || values[i] < values[low]) low = i;
        if (high == to || values[i] > values[high]) high = i;
    }
    if (low == to) return {no_value, no_value};
    return {values[std::min(low, high)], values[std::max(low, high)]};
}

void widen(std::pair<double, double>& range, double value) {
    if (!std::isfinite(value)) return;
    range.first = std::min(range.first, value);
    range.second = std::max(range.second, value);
}

void widen(std::pair<double, double>& range, const PlotTable& table, const std::string& column) {
    if (const Column* const found = table.column(column)) {
        for (const double value : found->values) widen(range, value);
    }
}

}  // namespace

const Column* PlotTable::column(std::string_view column_name) const {
    const auto found = std::ranges::find(columns, column_name, &Column::name);
    return found == columns.end() ? nullptr : &*found;
}

PlotTable thinned(PlotTable table, std::size_t pixels) {
    const std::size_t rows = table.x.size();
    if (pixels == 0 || rows <= 2 * pixels) return table;
    PlotTable thin{table.name, table.x_label, {}, {}};
    for (const Column& column : table.columns) thin.columns.push_back({column.name, {}});
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        const std::size_t from = pixel * rows / pixels, to = (pixel + 1) * rows / pixels;
        thin.x.push_back(table.x[from]);
        thin.x.push_back(table.x[to - 1]);
        for (std::size_t c = 0; c < table.columns.size(); ++c) {
            const auto [first, second] = extremes_in_order(table.columns[c].values, from, to);
            thin.columns[c].values.push_back(first);
            thin.columns[c].values.push_back(second);
        }
    }
    return thin;
}

double rounded(double value_C) {
    constexpr double per_C =
        1e4;  // dividing by a whole number gives the double that is nearest to the decimal
    return std::isfinite(value_C) ? std::round(value_C * per_C) / per_C : value_C;
}

std::vector<double> rounded(std::vector<double> values_C) {
    for (double& value_C : values_C) value_C = rounded(value_C);
    return values_C;
}

std::pair<std::string, double> time_unit(double span_s) {
    constexpr double longest_in_minutes_s = 10.0 * 3600.0;
    return span_s <= longest_in_minutes_s ? std::pair(std::string("min"), 60.0)
                                          : std::pair(std::string("h"), 3600.0);
}

std::pair<double, double> value_range(const Plot& plot, const PlotTable& table) {
    if (plot.range) return *plot.range;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    std::pair range{infinity, -infinity};
    for (const PlotLine& line : plot.lines) widen(range, table, line.column);
    for (const PlotBand& band : plot.bands) {
        widen(range, table, band.low);
        widen(range, table, band.high);
    }
    for (const PlotStrip& strip : plot.strips) {
        widen(range, strip.low);
        widen(range, strip.high);
    }
    if (!(range.first <= range.second)) return {0.0, 1.0};
    constexpr double margin_share = 0.06, least_margin = 0.02;
    const double margin = std::max(margin_share * (range.second - range.first), least_margin);
    return {range.first - margin, range.second + margin};
}

}  // namespace thermbal
