#include "report/page.hpp"

#include <fmt/format.h>

#include "report/assets.hpp"
#include "report/html.hpp"
#include "report/verdict_json.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

json values_to_json(const std::vector<double>& values) {
    json list = json::array();
    for (const double value : values) list.push_back(number_or_null(value));
    return list;
}

json plot_to_json(const Plot& plot, const PlotTable& table) {
    constexpr const char* strokes[] = {"solid", "dashed", "dots"};
    json lines = json::array(), bands = json::array(), strips = json::array(), marks = json::array();
    for (const PlotLine& line : plot.lines) {
        lines.push_back({{"label", line.label},
                         {"column", line.column},
                         {"colour", line.colour},
                         {"stroke", strokes[static_cast<int>(line.stroke)]}});
    }
    for (const PlotBand& band : plot.bands)
        bands.push_back({{"low", band.low}, {"high", band.high}, {"colour", band.colour}});
    for (const PlotStrip& strip : plot.strips) {
        strips.push_back({{"from_x", number_or_null(strip.from_x)},
                          {"to_x", number_or_null(strip.to_x)},
                          {"low", number_or_null(strip.low)},
                          {"high", number_or_null(strip.high)},
                          {"colour", strip.colour}});
    }
    for (const PlotMark& mark : plot.marks)
        marks.push_back({{"x", number_or_null(mark.x)}, {"label", mark.label}});
    const auto [low, high] = value_range(plot, table);
    return {{"table", plot.table},
            {"unit", plot.unit},
            {"range", {low, high}},
            {"height_px", plot.height_px},
            {"label_lines", plot.label_lines},
            {"lines", std::move(lines)},
            {"bands", std::move(bands)},
            {"strips", std::move(strips)},
            {"marks", std::move(marks)}};
}

std::string key_of(const Plot& plot) {
    std::string key;
    for (const PlotLine& line : plot.lines)
        key += fmt::format(R"html(<span class="key" style="--k:var(--{})">{}</span>)html", line.colour,
                           escaped(line.label));
    return key;
}

/// Inside a script element: no "</script" and no "<!--" may be in it.
std::string for_script(const json& document) {
    std::string text = document.dump(-1, ' ', false, json::error_handler_t::replace);
    for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1))
        text.replace(at, 1, "\\u003c");
    return text;
}

}  // namespace

json table_to_json(const PlotTable& table) {
    json columns = json::object();
    for (const Column& column : table.columns) columns[column.name] = values_to_json(column.values);
    return {{"x_label", table.x_label}, {"x", values_to_json(table.x)}, {"columns", std::move(columns)}};
}

void Page::add_table(PlotTable table) {
    const std::string name = table.name;
    tables_.insert_or_assign(name, std::move(table));
}

std::string Page::figure(const Plot& plot) {
    const PlotTable& table = tables_.at(plot.table);
    plots_[plot.id] = plot_to_json(plot, table);
    return fmt::format(
        R"(<figure id="{0}" data-plot="{0}" style="--plot-height:{1}px"><figcaption><b>{2}</b>{3}<output></output></figcaption><div class="live"></div><div class="still">{4}</div></figure>)",
        plot.id, plot.height_px, escaped(plot.title), plot.label_lines ? std::string() : key_of(plot),
        svg_plot(plot, table));
}

std::string Page::html() const {
    json tables = json::object();
    for (const auto& [name, table] : tables_) tables[name] = table_to_json(table);
    // The policy is a second line behind escaping: nothing is ever fetched, whatever the page's text says.
    return fmt::format(
        R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'">
<meta name="viewport" content="width=device-width, initial-scale=1"><meta name="color-scheme" content="light dark">
<title>{}</title><style>{}{}</style></head>
<body><main>{}</main>
<script type="application/json" id="plots">{}</script>
<script>{}</script><script>{}</script><script>thermbalPlots.drawPage();</script>
</body></html>
)",
        escaped(title_), dygraphs_css(), page_css(), body_,
        for_script({{"tables", std::move(tables)}, {"plots", plots_}}), dygraphs_js(), plots_js());
}

}  // namespace thermbal
