#include "svg_plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace thermbal {
namespace {

constexpr double width_px = 560.0, left_px = 46.0, right_px = 8.0, top_px = 8.0, bottom_px = 22.0;
constexpr std::size_t most_points = 600;

struct Axis {
    double low, high, from_px, to_px;
    double at(double value) const { return from_px + (value - low) / (high - low) * (to_px - from_px); }
};

/// A round step that divides the span into about `parts`.
double tick_step(double span, int parts) {
    const double raw = span / parts;
    const double power = std::pow(10.0, std::floor(std::log10(raw)));
    for (const double factor : {1.0, 2.0, 5.0}) {
        if (raw <= factor * power) return factor * power;
    }
    return 10.0 * power;
}

Axis value_axis(const std::vector<PlotLine>& lines, int height_px) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const PlotLine& line : lines) {
        for (const double value : line.values) {
            if (!std::isfinite(value)) continue;
            low = std::min(low, value);
            high = std::max(high, value);
        }
    }
    if (!(low <= high)) low = high = 0.0;
    const double margin = std::max(0.05 * (high - low), 0.02);
    return {low - margin, high + margin, height_px - bottom_px, top_px};
}

std::string grid(const Axis& x, const Axis& y, const std::string& unit, int height_px) {
    std::string svg;
    const double y_step = tick_step(y.high - y.low, 4), x_step = tick_step(x.high - x.low, 6);
    for (double v = std::ceil(y.low / y_step) * y_step; v <= y.high; v += y_step) {
        svg += fmt::format(
            R"(<path class="g" d="M{} {:.1f}H{}"/><text x="{}" y="{:.1f}" text-anchor="end">{:g}</text>)",
            left_px, y.at(v), width_px - right_px, left_px - 4, y.at(v) + 3, std::abs(v) < 1e-9 ? 0.0 : v);
    }
    for (double v = std::ceil(x.low / x_step) * x_step; v <= x.high; v += x_step) {
        svg += fmt::format(R"(<text x="{:.1f}" y="{}" text-anchor="middle">{:g}</text>)", x.at(v),
                           height_px - 8, v);
    }
    return svg +
           fmt::format(R"(<text x="2" y="12">{}</text><text x="{}" y="{}" text-anchor="end">min</text>)",
                       unit, width_px - right_px, height_px - 8);
}

std::string polyline(const std::vector<double>& time_s, const PlotLine& line, const Axis& x, const Axis& y) {
    std::string path;
    bool down = false;
    const std::size_t stride = std::max<std::size_t>(1, time_s.size() / most_points);
    for (std::size_t k = 0; k < time_s.size(); k += stride) {
        const double value = line.values(static_cast<Eigen::Index>(k));
        if (std::isfinite(value))
            path += fmt::format("{}{:.1f} {:.1f}", down ? "L" : "M", x.at(time_s[k] / 60.0), y.at(value));
        down = std::isfinite(value);
    }
    return fmt::format(R"(<path class="l" stroke="{}" d="{}"><title>{}</title></path>)", line.colour, path,
                       line.name);
}

}  // namespace

std::string svg_plot(const std::vector<double>& time_s, const std::vector<PlotLine>& lines,
                     const std::string& unit, int height_px) {
    if (time_s.empty()) return {};
    const Axis x{time_s.front() / 60.0, std::max(time_s.back() / 60.0, time_s.front() / 60.0 + 1e-3), left_px,
                 width_px - right_px};
    const Axis y = value_axis(lines, height_px);
    std::string svg = fmt::format(R"(<svg viewBox="0 0 {} {}" width="{}" height="{}" role="img">)", width_px,
                                  height_px, width_px, height_px);
    svg += grid(x, y, unit, height_px);
    for (const PlotLine& line : lines) svg += polyline(time_s, line, x, y);
    return svg + "</svg>";
}

}  // namespace thermbal
