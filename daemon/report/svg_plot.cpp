#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "report/html.hpp"
#include "report/plot.hpp"

namespace thermbal {
namespace {

constexpr double width_px = 640.0, left_px = 52.0, right_px = 10.0, top_px = 18.0, bottom_px = 22.0;
constexpr double label_px = 44.0;  // for the names at the right ends of lines
constexpr double line_height_px = 11.0;
constexpr std::size_t pixels_of_a_still = 320;

constexpr char own_colours[] =
    "<style>svg{--ink:#1c2733;--muted:#6b7785;--line:#e3e8ee;--accent:#0b66c3;--c1:#d55e00;--c2:#e69f00;"
    "--c3:#cc79a7;--c4:#56b4e9;--c5:#0072b2;--c6:#009e73;--c7:#000;background:#fff;font-family:sans-serif}"
    "svg text{font-size:11px;fill:#6b7785}svg .g{stroke:#e3e8ee;fill:none}"
    "svg .l{fill:none;stroke-width:1.5;stroke-linejoin:round}</style>";

struct Axis {
    double low, high, from_px, to_px;
    double at(double value) const {
        return from_px + (std::clamp(value, low, high) - low) / (high - low) * (to_px - from_px);
    }
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

double tidy(double tick, double step) {
    return std::abs(tick) < 1e-6 * step ? 0.0 : tick;
}

std::string grid(const Plot& plot, const PlotTable& table, const Axis& x, const Axis& y) {
    std::string svg;
    const double y_step = tick_step(y.high - y.low, 4), x_step = tick_step(x.high - x.low, 7);
    for (double v = std::ceil(y.low / y_step) * y_step; v <= y.high; v += y_step) {
        svg += fmt::format(
            R"(<path class="g" d="M{:.0f} {:.1f}H{:.0f}"/><text x="{:.0f}" y="{:.1f}" text-anchor="end">{:.6g}</text>)",
            left_px, y.at(v), x.to_px, left_px - 6, y.at(v) + 4, tidy(v, y_step));
    }
    for (double v = std::ceil(x.low / x_step) * x_step; v <= x.high; v += x_step) {
        if (x.at(v) > x.to_px - 24) continue;  // the unit stands there
        svg += fmt::format(R"(<text x="{:.1f}" y="{:.0f}" text-anchor="middle">{:.6g}</text>)", x.at(v),
                           y.from_px + 16, tidy(v, x_step));
    }
    return svg +
           fmt::format(
               R"(<text x="{:.0f}" y="11" text-anchor="end">{}</text><text x="{:.0f}" y="{:.0f}" text-anchor="end">{}</text>)",
               left_px - 6, escaped(plot.unit), x.to_px, y.from_px + 16, escaped(table.x_label));
}

std::string rectangle(const PlotStrip& strip, const Axis& x, const Axis& y) {
    const double left = x.at(strip.from_x), right = x.at(strip.to_x);
    return fmt::format(
        R"html(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" style="fill:var(--{})" fill-opacity=".16"/>)html",
        left, y.at(strip.high), right - left, y.at(strip.low) - y.at(strip.high), strip.colour);
}

std::string band(const PlotBand& band, const PlotTable& table, const Axis& x, const Axis& y) {
    const Column* const low = table.column(band.low);
    const Column* const high = table.column(band.high);
    if (low == nullptr || high == nullptr) return {};
    std::string above, below;
    for (std::size_t i = 0; i < table.x.size(); ++i) {
        if (!std::isfinite(low->values[i]) || !std::isfinite(high->values[i])) continue;
        above += fmt::format("{:.1f},{:.1f} ", x.at(table.x[i]), y.at(high->values[i]));
        below.insert(0, fmt::format("{:.1f},{:.1f} ", x.at(table.x[i]), y.at(low->values[i])));
    }
    return fmt::format(R"html(<polygon points="{}{}" style="fill:var(--{})" fill-opacity=".13"/>)html", above,
                       below, band.colour);
}

std::string path(const PlotLine& line, const PlotTable& table, const Axis& x, const Axis& y) {
    const Column* const column = table.column(line.column);
    if (column == nullptr) return {};
    std::string points;
    bool down = false;
    const bool dots = line.stroke == PlotLine::Stroke::dots;
    for (std::size_t i = 0; i < table.x.size(); ++i) {
        const bool there = std::isfinite(column->values[i]);
        if (there) {
            points += fmt::format("{}{:.1f} {:.1f}{}", down && !dots ? "L" : "M", x.at(table.x[i]),
                                  y.at(column->values[i]), dots ? "h0" : "");
        }
        down = there;
    }
    const char* const style = dots ? R"( stroke-width="5" stroke-linecap="round")"
                              : line.stroke == PlotLine::Stroke::dashed ? R"( stroke-dasharray="5 4")"
                                                                        : "";
    return fmt::format(R"html(<path class="{}" style="stroke:var(--{})"{} d="{}"/>)html", dots ? "d" : "l",
                       line.colour, style, points);
}

std::string mark(const PlotMark& mark, const Axis& x, const Axis& y) {
    if (!(x.low <= mark.x && mark.x <= x.high)) return {};
    return fmt::format(
        R"html(<path d="M{0:.1f} {1:.0f}V{2:.0f}" style="stroke:var(--muted)" stroke-dasharray="2 3"/><text x="{3:.1f}" y="{4:.0f}">{5}</text>)html",
        x.at(mark.x), y.from_px, y.to_px, x.at(mark.x) + 4, y.to_px + 9, escaped(mark.label));
}

using EndLabel = std::pair<double, std::string>;

/// Sorted labels that would lie on each other become a stack about the middle of where they belong.
void spread(std::vector<EndLabel>& labels, double lowest_px) {
    struct Stack {
        double top;
        std::size_t first, count;
        double height() const { return static_cast<double>(count) * line_height_px; }
    };
    std::vector<Stack> stacks;
    for (std::size_t i = 0; i < labels.size(); ++i) {
        stacks.push_back({labels[i].first, i, 1});
        while (stacks.size() > 1) {
            Stack& above = stacks[stacks.size() - 2];
            const Stack below = stacks.back();
            if (above.top + above.height() <= below.top) break;
            const auto a = static_cast<double>(above.count), b = static_cast<double>(below.count);
            above.top = (a * above.top + b * (below.top - above.height())) / (a + b);
            above.count += below.count;
            stacks.pop_back();
        }
    }
    for (const Stack& stack : stacks) {
        const double top = std::min(stack.top, lowest_px - stack.height() + line_height_px);
        for (std::size_t i = 0; i < stack.count; ++i)
            labels[stack.first + i].first = top + static_cast<double>(i) * line_height_px;
    }
}

/// Names at the right ends, pushed apart where they would lie on each other.
std::string end_labels(const Plot& plot, const PlotTable& table, const Axis& x, const Axis& y) {
    std::vector<EndLabel> labels;
    for (const PlotLine& line : plot.lines) {
        const Column* const column = table.column(line.column);
        if (column == nullptr) continue;
        const auto last = std::ranges::find_if(column->values.rbegin(), column->values.rend(),
                                               [](double value) { return std::isfinite(value); });
        if (last != column->values.rend()) labels.emplace_back(y.at(*last) + 4, line.label);
    }
    std::ranges::sort(labels);
    spread(labels, y.from_px + 4);
    std::string svg;
    for (const auto& [at, label] : labels)
        svg += fmt::format(R"(<text x="{:.0f}" y="{:.1f}">{}</text>)", x.to_px + 5, at, escaped(label));
    return svg;
}

/// The table without the rows at its end in which nothing of the plot is.
Axis time_axis(const Plot& plot, const PlotTable& table) {
    double low = table.x.empty() ? 0.0 : table.x.front(), high = low;
    for (const PlotLine& line : plot.lines) {
        const Column* const column = table.column(line.column);
        for (std::size_t i = 0; column != nullptr && i < table.x.size(); ++i) {
            if (std::isfinite(column->values[i])) high = std::max(high, table.x[i]);
        }
    }
    return {low, std::max(high, low + 1e-3), left_px, width_px - (plot.label_lines ? label_px : right_px)};
}

}  // namespace

std::string svg_plot(const Plot& plot, const PlotTable& table, bool standalone) {
    const PlotTable still = thinned(table, pixels_of_a_still);
    const auto [low, high] = value_range(plot, table);
    const Axis x = time_axis(plot, table);
    const Axis y{low, high, plot.height_px - bottom_px, top_px};
    std::string svg = fmt::format(
        R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0:.0f} {1}" width="{0:.0f}" height="{1}" role="img" aria-label="{2}">{3})",
        width_px, plot.height_px, escaped(plot.title), standalone ? own_colours : "");
    for (const PlotStrip& strip : plot.strips) svg += rectangle(strip, x, y);
    for (const PlotBand& one : plot.bands) svg += band(one, still, x, y);
    svg += grid(plot, table, x, y);
    for (const PlotLine& line : plot.lines) svg += path(line, still, x, y);
    for (const PlotMark& one : plot.marks) svg += mark(one, x, y);
    if (plot.label_lines) svg += end_labels(plot, still, x, y);
    return svg + "</svg>";
}

}  // namespace thermbal
