#include "plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "columns.hpp"
#include "fields.hpp"

namespace thermbal {

using nlohmann::json;

namespace {

double value_or_nan(const json& value) {
    return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

/// A bar of `length` columns, to an eighth of a column with unicode.
std::string bar(double length, bool unicode) {
    constexpr std::array<std::string_view, 8> eighths = {"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
    if (!unicode) return std::string(static_cast<std::size_t>(std::lround(std::max(length, 1.0))), '#');
    const auto parts = static_cast<std::size_t>(std::lround(std::max(length, 0.125) * 8.0));
    std::string drawn;
    for (std::size_t i = 0; i < parts / 8; ++i) drawn += "█";
    return drawn.append(eighths.at(parts % 8));
}

}  // namespace

std::string sparkline(const json& values, std::size_t width, bool unicode, double least_span) {
    constexpr std::array<std::string_view, 8> blocks = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
    constexpr std::array<std::string_view, 8> letters = {"_", ".", ",", "-", "=", "+", "*", "#"};
    const auto& levels = unicode ? blocks : letters;
    const std::size_t count = values.is_array() ? std::min(values.size(), width) : 0;
    const auto value_at = [&](std::size_t i) {
        return value_or_nan(values[(i + 1) * values.size() / count - 1]);
    };
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (std::size_t i = 0; i < count; ++i) {
        const double value = value_at(i);
        if (!std::isfinite(value)) continue;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    const double span = std::max(high - low, least_span);
    const double base = (low + high - span) / 2.0;
    std::string line(width - count, ' ');
    for (std::size_t i = 0; i < count; ++i) {
        const double level = (value_at(i) - base) / span * 8.0;
        line += std::isfinite(level) ? levels.at(static_cast<std::size_t>(std::clamp(level, 0.0, 7.0))) : " ";
    }
    return line;
}

std::string curve_plot(const json& curve, std::size_t width, bool unicode) {
    const json& rmse_C = list(curve, "rmse_by_n_C");
    double largest = 0.0;
    std::size_t best = rmse_C.size();
    for (std::size_t i = 0; i < rmse_C.size(); ++i) {
        const double value = value_or_nan(rmse_C[i]);
        if (!std::isfinite(value)) continue;
        largest = std::max(largest, value);
        if (best == rmse_C.size() || value < value_or_nan(rmse_C[best])) best = i;
    }
    std::string plot = fmt::format("{}: RMSE against n", printable(text(curve, "channel")));
    if (const auto end_min = number(curve, "window_end_min"))
        plot += fmt::format(", window to {:.2f} min", *end_min);
    plot += "\n";
    if (best == rmse_C.size()) return plot + "not swept on this window yet\n";

    constexpr std::size_t labels = 31;  // "35  0.123 C  " before and "  <- minimum, chosen" behind
    const double room = static_cast<double>(std::max<std::size_t>(width, labels + 10) - labels - 2);
    const double chosen = number(curve, "n").value_or(0.0);
    plot += " n     RMSE\n";
    for (std::size_t i = 0; i < rmse_C.size(); ++i) {
        const double value = value_or_nan(rmse_C[i]);
        const bool is_chosen = static_cast<double>(i + 1) == chosen;
        plot += fmt::format("{:>2}  ", i + 1);
        if (std::isfinite(value)) {
            plot +=
                fmt::format("{:.3f} C  {}", value, bar(largest > 0 ? value / largest * room : 0.0, unicode));
        } else {
            plot += "-";
        }
        if (i == best) plot += is_chosen ? "  <- minimum, chosen" : "  <- minimum";
        if (i != best && is_chosen) plot += "  <- chosen";
        plot += "\n";
    }
    return plot;
}

}  // namespace thermbal
