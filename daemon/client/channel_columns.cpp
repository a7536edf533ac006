#include "channel_columns.hpp"

#include <algorithm>
#include <ranges>

#include <fmt/format.h>

#include "answers.hpp"
#include "fields.hpp"
#include "plots.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

/// Of readings that are not there any more nothing is said as if it were of now.
std::optional<double> current(const json& channel, const char* key) {
    return text(channel, "quality") == "good" ? number(channel, key) : std::nullopt;
}

bool is_declared(const json& channel) {
    return text(channel, "state") == "declared";
}

Ink ink_of_state(const json& channel) {
    const std::string state = text(channel, "state");
    if (state == "declared") return Ink::good_bold;
    if (state == "stuck" || state == "dead") return Ink::bad;
    return state == "measuring" ? Ink::plain : Ink::dim;
}

ChannelCell value_cell(const json& channel, std::size_t width) {
    const bool good = text(channel, "quality") == "good";
    return {value_or_quality(channel, width < 13), good ? Ink::bold : Ink::bad};
}

/// What is not declared is a prediction in progress, and looks like one.
ChannelCell settles_cell(const json& channel, std::size_t /*width*/) {
    return {fixed(number(channel, "steady_state_C"), 2), is_declared(channel) ? Ink::good_bold : Ink::dim};
}

ChannelCell interval_cell(const json& channel, std::size_t width) {
    const auto low = number(channel, "steady_state_low_C");
    const auto high = number(channel, "steady_state_high_C");
    const Ink ink = is_declared(channel) ? Ink::good : Ink::dim;
    if (!low || !high) return {"-", Ink::dim};
    std::string interval = fmt::format("{:.2f}..{:.2f}", *low, *high);
    if (interval.size() > width) interval = fmt::format("{:.1f}..{:.1f}", *low, *high);
    if (interval.size() > width) interval = fmt::format("{:.0f}..{:.0f}", *low, *high);
    return {std::move(interval), ink};
}

ChannelCell n_cell(const json& channel, std::size_t /*width*/) {
    const auto n = number(channel, "n");
    return {n && *n > 0 ? fixed(n, 0) : "-", Ink::plain};
}

/// Measured less simulated; red where that cannot be noise and the model's own limits.
ChannelCell residual_cell(const json& channel, std::size_t /*width*/) {
    return {with_sign(number(channel, "residual_C"), 2), flag(channel, "disagrees") ? Ink::bad : Ink::plain};
}

std::vector<ChannelColumn> all_columns(bool unicode) {
    const auto field = [](const char* key) {
        return
            [key](const json& channel, std::size_t) { return ChannelCell{text(channel, key), Ink::plain}; };
    };
    return {
        {"", 3, 4, 0, false,
         [](const json& channel, std::size_t) { return ChannelCell{text(channel, "channel"), Ink::bold}; }},
        {"place", 14, 24, 8, false, field("place")},
        {"value C", 7, 7, 0, true, value_cell},
        {"rise C", 6, 6, 3, true,
         [](const json& channel, std::size_t) {
             return ChannelCell{with_sign(current(channel, "rise_C"), 2), Ink::plain};
         }},
        {"C/h", 6, 6, 2, true,
         [](const json& channel, std::size_t) {
             return ChannelCell{with_sign(current(channel, "rate_C_per_h"), 1), Ink::plain};
         }},
        {"resid C", 7, 7, 2, true, residual_cell},
        {"trend", 7, 24, 5, false,
         [unicode](const json& channel, std::size_t width) {
             return ChannelCell{sparkline(list(channel, "recent_C"), width, unicode),
                                is_declared(channel) ? Ink::good : Ink::plain};
         }},
        {"n", 2, 2, 6, true, n_cell},
        {"RMSE", 5, 5, 7, true,
         [](const json& channel, std::size_t) {
             return ChannelCell{fixed(number(channel, "window_rmse_C"), 3), Ink::plain};
         }},
        {"steady", 6, 7, 0, true, settles_cell},
        {"90 % between", 12, 14, 4, true, interval_cell},
        {"left", 7, 7, 1, true,
         [](const json& channel, std::size_t) {
             return ChannelCell{minutes(number(channel, "time_left_min")), Ink::plain};
         }},
        {"state", 9, 9, 0, false,
         [](const json& channel, std::size_t) {
             return ChannelCell{state_name(channel), ink_of_state(channel)};
         }},
        {"reason", 24, 200, 9, false,
         [](const json& channel, std::size_t) {
             const std::string reason = text(channel, "reason");
             return ChannelCell{reason == text(channel, "state") ? std::string() : reason, Ink::dim};
         }},
    };
}

std::size_t total_width(const std::vector<ChannelColumn>& columns) {
    std::size_t total = columns.empty() ? 0 : columns.size() - 1;
    for (const ChannelColumn& column : columns) total += column.width;
    return total;
}

}  // namespace

std::vector<ChannelColumn> fitting_columns(const json& channels, std::size_t width, bool unicode) {
    std::vector<ChannelColumn> columns = all_columns(unicode);
    const bool has_places =
        std::ranges::any_of(channels, [](const json& channel) { return !text(channel, "place").empty(); });
    if (!has_places)
        std::erase_if(columns, [](const ChannelColumn& column) { return column.title == "place"; });
    const bool is_compared =
        std::ranges::any_of(channels, [](const json& channel) { return channel.contains("residual_C"); });
    if (!is_compared)
        std::erase_if(columns, [](const ChannelColumn& column) { return column.title == "resid C"; });
    while (total_width(columns) > width) {
        const auto least = std::ranges::max_element(columns, {}, &ChannelColumn::rank);
        if (least->rank == 0) break;
        columns.erase(least);
    }
    std::size_t room = width - std::min(width, total_width(columns));
    for (ChannelColumn& column : columns) {
        const std::size_t more = std::min(room, column.most_width - column.width);
        column.width += more;
        room -= more;
    }
    return columns;
}

}  // namespace thermbal
