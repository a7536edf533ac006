#include "comparison_text.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "columns.hpp"
#include "fields.hpp"
#include "report/verdict_json.hpp"
#include "statistics.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

/// What one estimator does at one window over all channels that settled.
json estimator_summary(const json& document, std::size_t window, const std::string& estimator) {
    std::vector<double> errors_C;
    int held = 0;
    int intervals = 0;
    for (const json& channel : document["channels"]) {
        if (!flag(channel["end"], "settled")) continue;
        const json& answer = channel["windows"][window]["estimators"][estimator];
        if (const auto error_C = number(answer, "error_C")) errors_C.push_back(std::abs(*error_C));
        if (!answer["held"].is_boolean()) continue;
        ++intervals;
        held += answer["held"].get<bool>() ? 1 : 0;
    }
    const auto worst = std::ranges::max_element(errors_C);
    return {{"answers", errors_C.size()},
            {"median_error_C", number_or_null(median(errors_C))},
            {"worst_error_C", worst == errors_C.end() ? json(nullptr) : json(*worst)},
            {"held_share", intervals == 0 ? json(nullptr) : json(static_cast<double>(held) / intervals)}};
}

std::string end_text(const json& document) {
    std::string text = fmt::format(
        "{}: {:.0f} min; errors are against the mean of the last 15 min of the regime that the recording "
        "ends in "
        "(since {:.1f} min), moved with the room\n",
        printable(document["recording"].get<std::string>()), document["end_min"].get<double>(),
        document["regime_since_min"].get<double>());
    for (const json& channel : document["channels"]) {
        const json& end = channel["end"];
        if (flag(end, "settled")) continue;
        text += fmt::format("{} has not settled and is left out of the summary: {}\n",
                            printable(channel["channel"].get<std::string>()),
                            printable(end["figures"].get<std::string>()));
    }
    return text;
}

std::string summary_text(const json& document) {
    std::vector<TextTable::Column> columns{{"window", true}, {"limit", true}};
    for (const json& estimator : document["estimators"]) {
        columns.push_back({estimator["name"].get<std::string>()});
        columns.push_back({"held", true});
    }
    TextTable table(columns);
    for (const json& row : document["summary"]) {
        std::vector<std::string> cells{minutes(number(row, "window_end_min")),
                                       fixed(number(row, "median_least_half_width_C"), 3)};
        for (const json& estimator : document["estimators"]) {
            const json& figures = row["estimators"][estimator["name"].get<std::string>()];
            cells.push_back(fixed(number(figures, "median_error_C"), 3) + " / " +
                            fixed(number(figures, "worst_error_C"), 2));
            cells.push_back(fixed(number(figures, "held_share"), 2));
        }
        table.add(cells);
    }
    return "median / worst absolute error in C over the channels, and the share of 90 % intervals that held; "
           "limit: least "
           "half width of such an interval, median\n" +
           table.str();
}

std::string channel_text(const json& document, const json& channel) {
    std::string text = fmt::format(
        "\n{}: {}; knowable within {:.2f} C from {}\n", printable(channel["channel"].get<std::string>()),
        printable(channel["end"]["figures"].get<std::string>()), document["tolerance_C"].get<double>(),
        minutes(number(channel, "earliest_knowable_min")));
    TextTable table({{"window", true},
                     {"settles", true},
                     {"limit", true},
                     {"estimator"},
                     {"says", true},
                     {"error", true},
                     {"90 % interval"},
                     {"95 % at", true},
                     {"note"}});
    for (const json& window : channel["windows"]) {
        for (const json& estimator : document["estimators"]) {
            const auto name = estimator["name"].get<std::string>();
            const json& answer = window["estimators"][name];
            const auto low_C = number(answer, "steady_state_low_C");
            table.add(
                {minutes(number(window, "window_end_min")), fixed(number(window, "settles_at_C"), 2),
                 fixed(number(window, "least_half_width_C"), 3), name,
                 fixed(number(answer, "steady_state_C"), 2), with_sign(number(answer, "error_C"), 2),
                 low_C ? fixed(low_C, 2) + " .. " + fixed(number(answer, "steady_state_high_C"), 2) : "-",
                 minutes(number(answer, "equilibrium_time_min")), answer["note"].get<std::string>()});
        }
    }
    return text + table.str();
}

}  // namespace

json comparison_summary(const json& document) {
    json rows = json::array();
    const json& channels = document["channels"];
    const std::size_t windows = channels.empty() ? 0 : channels[0]["windows"].size();
    for (std::size_t window = 0; window < windows; ++window) {
        std::vector<double> limits_C;
        for (const json& channel : channels) {
            const auto limit_C = number(channel["windows"][window], "least_half_width_C");
            if (limit_C && flag(channel["end"], "settled")) limits_C.push_back(*limit_C);
        }
        json estimators = json::object();
        for (const json& estimator : document["estimators"]) {
            const auto name = estimator["name"].get<std::string>();
            estimators[name] = estimator_summary(document, window, name);
        }
        rows.push_back({{"window_end_min", channels[0]["windows"][window]["window_end_min"]},
                        {"median_least_half_width_C", number_or_null(median(limits_C))},
                        {"estimators", std::move(estimators)}});
    }
    return rows;
}

std::string comparison_text(const json& document, bool by_channel) {
    std::string text = end_text(document) + summary_text(document);
    if (!by_channel) return text + "name channels with --channel to see every prediction\n";
    for (const json& channel : document["channels"]) text += channel_text(document, channel);
    return text;
}

}  // namespace thermbal
