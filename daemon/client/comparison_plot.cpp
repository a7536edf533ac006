#include "comparison_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <ranges>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "fields.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

// Colours that stay apart for colour-blind eyes (Okabe and Ito).
constexpr std::array<std::string_view, 7> colours = {"#d55e00", "#e69f00", "#cc79a7", "#56b4e9",
                                                     "#0072b2", "#009e73", "#000000"};
constexpr double panel_width = 420.0, panel_height = 220.0;
constexpr double left = 46.0, right = 8.0, top = 26.0, bottom = 30.0;
constexpr double legend_height = 28.0;
constexpr std::size_t panels_a_row = 3;

struct Point {
    double minute;
    double error_C;
};

std::string escaped(std::string_view text) {
    std::string safe;
    for (const char letter : text) {
        if (letter == '<')
            safe += "&lt;";
        else if (letter == '>')
            safe += "&gt;";
        else if (letter == '&')
            safe += "&amp;";
        else if (letter == '"')
            safe += "&quot;";
        else
            safe += letter;
    }
    return safe;
}

/// A channel's panel: error against time, clipped to the scale.
class Panel {
  public:
    Panel(double x, double y, double end_min, double scale_C)
        : x_(x), y_(y), end_min_(end_min), scale_C_(scale_C) {}

    std::string at(Point point) const {
        const double error_C = std::clamp(point.error_C, -scale_C_, scale_C_);
        return fmt::format("{:.1f},{:.1f}",
                           x_ + left + point.minute / end_min_ * (panel_width - left - right),
                           middle() - error_C / scale_C_ * half());
    }

    std::string line(const std::vector<Point>& points, std::string_view style) const {
        std::string path;
        for (const Point& point : points) path += (path.empty() ? "M" : " L") + at(point);
        return path.empty() ? path : fmt::format("<path d=\"{}\" fill=\"none\" {}/>\n", path, style);
    }

    /// Between low and high, which belong to the same minutes.
    std::string band(const std::vector<Point>& low, const std::vector<Point>& high,
                     std::string_view style) const {
        std::string points;
        for (const Point& point : low) points += at(point) + " ";
        for (const Point& point : std::views::reverse(high)) points += at(point) + " ";
        return low.empty() ? points : fmt::format("<polygon points=\"{}\" {}/>\n", points, style);
    }

    std::string frame(std::string_view title) const {
        std::string text = fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" font-weight=\"bold\">{}</text>\n",
                                       x_ + left, y_ + top - 8.0, escaped(title));
        for (const double error_C : {-scale_C_, -0.5 * scale_C_, 0.0, 0.5 * scale_C_, scale_C_}) {
            const double y = middle() - error_C / scale_C_ * half();
            text += fmt::format(
                "<path d=\"M{:.1f},{:.1f} H{:.1f}\" stroke=\"#ddd\"/>"
                "<text x=\"{:.0f}\" y=\"{:.0f}\" text-anchor=\"end\">{:+.2g}</text>\n",
                x_ + left, y, x_ + panel_width - right, x_ + left - 4.0, y + 4.0, error_C);
        }
        for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
            text += fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" text-anchor=\"middle\">{:.0f}</text>\n",
                                x_ + left + share * (panel_width - left - right),
                                y_ + panel_height - bottom + 16.0, share * end_min_);
        }
        return text;
    }

  private:
    double middle() const { return y_ + 0.5 * (top + panel_height - bottom); }
    static double half() { return 0.5 * (panel_height - top - bottom); }

    double x_, y_, end_min_, scale_C_;
};

/// A member of every window less the truth there; windows without either are left out.
std::vector<Point> errors_of(const json& channel, const std::string& estimator, const char* key) {
    std::vector<Point> points;
    for (const json& window : channel["windows"]) {
        const json& answer = window["estimators"][estimator];
        const auto value_C = number(answer, key);
        const auto truth_C = number(window, "settles_at_C");
        const bool has_interval =
            number(answer, "steady_state_low_C") && number(answer, "steady_state_high_C");
        const bool is_bound = std::string_view(key) != "steady_state_C";
        if (value_C && truth_C && (has_interval || !is_bound))
            points.push_back({window["window_end_min"].get<double>(), *value_C - *truth_C});
    }
    return points;
}

std::vector<Point> limit_of(const json& channel, double sign) {
    std::vector<Point> points;
    for (const json& window : channel["windows"]) {
        if (const auto half_C = number(window, "least_half_width_C"))
            points.push_back({window["window_end_min"].get<double>(), sign * *half_C});
    }
    return points;
}

std::string panel_svg(const json& document, const json& channel, double x, double y) {
    const double tolerance_C = document["tolerance_C"].get<double>();
    const double end_min = document["end_min"].get<double>();
    const Panel panel(x, y, end_min, 5.0 * tolerance_C);
    const bool settled = flag(channel["end"], "settled");
    std::string text = panel.band({{0.0, -tolerance_C}, {end_min, -tolerance_C}},
                                  {{0.0, tolerance_C}, {end_min, tolerance_C}}, "fill=\"#eee\"");
    text += panel.frame(channel["channel"].get<std::string>() + (settled ? "" : " (not settled)"));
    for (std::size_t e = 0; e < document["estimators"].size(); ++e) {
        const auto name = document["estimators"][e]["name"].get<std::string>();
        const std::string_view colour = colours.at(e % colours.size());
        text += panel.band(errors_of(channel, name, "steady_state_low_C"),
                           errors_of(channel, name, "steady_state_high_C"),
                           fmt::format("fill=\"{}\" fill-opacity=\"0.12\"", colour));
        text += panel.line(errors_of(channel, name, "steady_state_C"),
                           fmt::format("stroke=\"{}\" stroke-width=\"1.6\"", colour));
    }
    for (const double sign : {-1.0, 1.0})
        text += panel.line(limit_of(channel, sign), "stroke=\"#000\" stroke-dasharray=\"4 3\"");
    return text;
}

std::string legend(const json& document) {
    std::string text;
    double x = left;
    const auto entry = [&](std::string_view name, std::string_view style) {
        text += fmt::format(
            "<path d=\"M{:.0f},14 h22\" fill=\"none\" {}/><text x=\"{:.0f}\" y=\"18\">{}</text>\n", x, style,
            x + 28.0, escaped(name));
        x += 44.0 + 7.0 * static_cast<double>(name.size());
    };
    for (std::size_t e = 0; e < document["estimators"].size(); ++e) {
        entry(document["estimators"][e]["name"].get<std::string>(),
              fmt::format("stroke=\"{}\" stroke-width=\"2\"", colours.at(e % colours.size())));
    }
    entry("information limit, all channels", "stroke=\"#000\" stroke-dasharray=\"4 3\"");
    return text;
}

}  // namespace

std::string comparison_svg(const json& document) {
    const std::size_t panels = document["channels"].size();
    const std::size_t columns = std::clamp<std::size_t>(panels, 1, panels_a_row);
    const std::size_t rows = (panels + columns - 1) / columns;
    const double width = std::max(2.0, static_cast<double>(columns)) * panel_width;
    const double height = legend_height + static_cast<double>(rows) * panel_height;
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" width=\"{:.0f}\" "
        "font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
        "<title>Error of each estimator in C against the window's end in min</title>\n",
        width, height, width);
    svg += legend(document);
    for (std::size_t i = 0; i < panels; ++i) {
        const std::size_t row = i / columns;
        svg +=
            panel_svg(document, document["channels"][i], static_cast<double>(i - row * columns) * panel_width,
                      legend_height + static_cast<double>(row) * panel_height);
    }
    return svg + "</svg>\n";
}

std::string comparison_page(const json& document) {
    return fmt::format(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title></head>\n"
        "<body style=\"font-family:sans-serif;margin:1.5em\"><h1>{0}</h1>\n"
        "<p>Error of the predicted steady state in C against the end of the window in min; the shaded strip "
        "is "
        "&#177;{1:.2f} C, bands are 90 % intervals, what lies outside the scale is drawn at its edge. Truth: "
        "the mean of the "
        "last 15 min of {2:.0f} min, moved with the room.</p>\n{3}</body></html>\n",
        escaped(document["recording"].get<std::string>()), document["tolerance_C"].get<double>(),
        document["end_min"].get<double>(), comparison_svg(document));
}

}  // namespace thermbal
