#include "comparison_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "fields.hpp"
#include "report/html.hpp"
#include "report/page.hpp"
#include "series/sample.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 7> colours = {"c1", "c2", "c3", "c4", "c5", "c6", "c7"};
constexpr double scale_in_tolerances = 5.0;  // what lies beyond is drawn at the edge

/// A channel's windows: the error of each estimator with its interval's ends, and the information limit.
PlotTable channel_table(const json& document, const json& channel, std::size_t index) {
    PlotTable table{fmt::format("channel{}", index), "min", {}, {}};
    for (const json& window : channel["windows"]) table.x.push_back(window["window_end_min"].get<double>());
    const auto add = [&](const std::string& name, const auto& value_of) {
        Column column{name, {}};
        for (const json& window : channel["windows"])
            column.values.push_back(rounded(value_of(window).value_or(no_value)));
        table.columns.push_back(std::move(column));
    };
    for (const json& one : document["estimators"]) {
        const auto name = one["name"].get<std::string>();
        const auto error_of = [&](const char* key) {
            return [&name, key](const json& window) -> std::optional<double> {
                const auto value_C = number(window["estimators"][name], key);
                const auto truth_C = number(window, "settles_at_C");
                return value_C && truth_C ? std::optional(*value_C - *truth_C) : std::nullopt;
            };
        };
        add(name, error_of("steady_state_C"));
        add(name + " low", error_of("steady_state_low_C"));
        add(name + " high", error_of("steady_state_high_C"));
    }
    for (const auto& [name, side] : {std::pair("limit below", -1.0), std::pair("limit above", 1.0)}) {
        add(name, [sign = side](const json& window) -> std::optional<double> {
            const auto half_C = number(window, "least_half_width_C");
            return half_C ? std::optional(sign * *half_C) : std::nullopt;
        });
    }
    return table;
}

Plot channel_plot(const json& document, const json& channel, std::size_t index) {
    const double tolerance_C = document["tolerance_C"].get<double>();
    const double edge_C = scale_in_tolerances * tolerance_C;
    const bool settled = flag(channel["end"], "settled");
    Plot plot{.id = fmt::format("channel{}", index),
              .title = channel["channel"].get<std::string>() + (settled ? "" : " (not settled)"),
              .table = fmt::format("channel{}", index),
              .unit = "°C",
              .lines = {},
              .strips = {{0.0, document["end_min"].get<double>(), -tolerance_C, tolerance_C, "muted"}},
              .range = std::pair(-edge_C, edge_C)};
    for (std::size_t e = 0; e < document["estimators"].size(); ++e) {
        const auto name = document["estimators"][e]["name"].get<std::string>();
        plot.lines.push_back({name, name, colours.at(e % colours.size())});
        plot.bands.push_back({name + " low", name + " high", colours.at(e % colours.size())});
    }
    plot.lines.push_back({"information limit, all channels", "limit above", "ink", PlotLine::Stroke::dashed});
    plot.lines.push_back({"", "limit below", "ink", PlotLine::Stroke::dashed});
    return plot;
}

}  // namespace

std::string comparison_svg(const json& document) {
    constexpr double panel_width_px = 660.0, panel_height_px = 250.0, key_height_px = 26.0;
    constexpr std::size_t panels_a_row = 3;
    const std::size_t panels = document["channels"].size();
    const std::size_t columns = std::clamp<std::size_t>(panels, 1, panels_a_row);
    const std::size_t rows = (panels + columns - 1) / columns;
    std::string key, drawn;
    for (std::size_t i = 0; i < panels; ++i) {
        const json& channel = document["channels"][i];
        const Plot plot = channel_plot(document, channel, i);
        const std::size_t row = i / columns;
        drawn += fmt::format(
            R"html(<g transform="translate({:.0f},{:.0f})"><text x="0" y="16">{}</text>{}</g>)html",
            static_cast<double>(i % columns) * panel_width_px,
            key_height_px + static_cast<double>(row) * panel_height_px, escaped(plot.title),
            svg_plot(plot, channel_table(document, channel, i), true));
        if (i > 0) continue;
        double x = 0.0;
        for (const PlotLine& line : plot.lines) {
            if (line.label.empty()) continue;
            key += fmt::format(R"html(<text x="{:.0f}" y="16" style="fill:var(--{})">{}</text>)html", x,
                               line.colour, escaped(line.label));
            x += 24.0 + 7.0 * static_cast<double>(line.label.size());
        }
    }
    const double width_px = static_cast<double>(columns) * panel_width_px;
    const double height_px = key_height_px + static_cast<double>(rows) * panel_height_px;
    return fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\">\n"
        "<title>Error of each estimator in C against the window's end in min</title>\n{2}{3}</svg>\n",
        width_px, height_px, key, drawn);
}

std::string comparison_page(const json& document) {
    const auto recording = document["recording"].get<std::string>();
    Page page(recording);
    page.add(fmt::format(
        "<h1>{}</h1><p>Error of the predicted steady state in &deg;C against the end of the window in min. "
        "The "
        "grey strip is &plusmn;{:.2f} &deg;C, bands are 90 % intervals, what lies outside the scale is drawn "
        "at "
        "its edge. Truth: the mean of the last 15 min of {:.0f} min, moved with the room.</p><div "
        "class=\"plots\">",
        escaped(recording), document["tolerance_C"].get<double>(), document["end_min"].get<double>()));
    for (std::size_t i = 0; i < document["channels"].size(); ++i) {
        const json& channel = document["channels"][i];
        page.add_table(channel_table(document, channel, i));
        page.add("<div class=\"card\">" + page.figure(channel_plot(document, channel, i)) + "</div>");
    }
    page.add("</div>");
    return page.html();
}

}  // namespace thermbal
