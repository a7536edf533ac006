#include "declaration/measured_end.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "series/sample.hpp"

namespace thermbal {
namespace {

/// Mean of the finite values at times in (until_s - mean_min, until_s].
double mean_of(std::span<const double> values, const TestWindow& grid, double until_s, double mean_min) {
    const std::size_t first = grid.scans_until(until_s - mean_min * 60.0);
    return mean_of_good(values.subspan(first, grid.scans_until(until_s) - first));
}

/// When the channel, by means of a minute, first is 63.2 % of its way from start to end.
double time_constant_min(const Column& column, const TestWindow& grid, double start_C, double end_C,
                         const MeasuredEndOptions& options) {
    const double way_C = end_C - start_C;
    if (std::abs(way_C) < options.least_rise_C) return options.time_constant_min;
    for (double minute = 1.0; minute * 60.0 <= grid.end_s() - grid.start_s; minute += 1.0) {
        const double value_C = mean_of(column.values, grid, grid.start_s + minute * 60.0, 1.0);
        if ((value_C - start_C) / way_C >= 1.0 - std::exp(-1.0)) return minute;
    }
    return options.time_constant_min;
}

/// The room through a first-order lag, from equilibrium with its first reading; a gap holds its last value.
std::vector<double> felt_room(const Column& room, double period_s, double lag_min) {
    const auto first = std::ranges::find_if(room.values, [](double value) { return std::isfinite(value); });
    double measured_C = first == room.values.end() ? no_value : *first;
    double felt_C = measured_C;
    const double share = -std::expm1(-period_s / 60.0 / lag_min);
    std::vector<double> felt;
    for (const double value_C : room.values) {
        if (std::isfinite(value_C)) measured_C = value_C;
        felt_C += share * (measured_C - felt_C);
        felt.push_back(felt_C);
    }
    return felt;
}

}  // namespace

double MeasuredEnd::settles_at_C(double room_at_C) const {
    return std::isfinite(room_C) && std::isfinite(room_at_C) ? mean_C + room_at_C - room_C : mean_C;
}

double mean_before_C(const TestWindow& window, std::string_view channel, double until_s, double mean_min) {
    const Column* const column = window.channel(channel);
    return column == nullptr ? no_value : mean_of(column->values, window, until_s, mean_min);
}

Result<MeasuredEnd> measured_end(const TestWindow& regime, std::string_view channel, std::string_view ambient,
                                 const MeasuredEndOptions& options) {
    const auto refuse = [&](const std::string& why) {
        return fail(NextStep::refuse_input, fmt::format("{}: {}", channel, why));
    };
    const Column* const column = regime.channel(channel);
    if (column == nullptr) return refuse("not in the recording");
    const Column* const room = ambient.empty() ? nullptr : regime.channel(ambient);
    if (!ambient.empty() && room == nullptr)
        return refuse(fmt::format("its ambient {} is not in the recording", ambient));
    const double end_s = regime.end_s();
    const double seen_min = (end_s - regime.start_s) / 60.0;
    const double needed_min = options.mean_min + options.apart_min;
    if (seen_min < needed_min) {
        return refuse(
            fmt::format("only {:.0f} min without a change of inputs are measured (needed {:.0f} min)",
                        seen_min, needed_min));
    }

    MeasuredEnd end;
    end.start_C = mean_of(column->values, regime, regime.start_s + 60.0, 1.0 + regime.period_s / 60.0);
    end.mean_C = mean_of(column->values, regime, end_s, options.mean_min);
    if (!std::isfinite(end.mean_C))
        return refuse(fmt::format("no good sample in the last {:.0f} min", options.mean_min));
    end.time_constant_min = time_constant_min(*column, regime, end.start_C, end.mean_C, options);

    std::vector<double> above_room = column->values;
    if (room != nullptr) {
        const std::vector<double> felt = felt_room(*room, regime.period_s, end.time_constant_min);
        for (std::size_t k = 0; k < felt.size(); ++k) above_room[k] -= felt[k];
        end.room_C = mean_of(felt, regime, end_s, options.mean_min);
        if (!std::isfinite(mean_of(room->values, regime, end_s, options.mean_min)))
            return refuse(fmt::format("no good sample of the room in the last {:.0f} min", options.mean_min));
    }
    const double earlier_C = mean_of(above_room, regime, end_s - options.apart_min * 60.0, options.mean_min);
    end.moved_C = mean_of(above_room, regime, end_s, options.mean_min) - earlier_C;
    end.still_to_come_C = end.moved_C / std::expm1(options.apart_min / end.time_constant_min);
    end.settled =
        std::abs(end.moved_C) <= options.settled_C && std::abs(end.still_to_come_C) <= options.settled_C;
    end.figures =
        fmt::format("moved {:+.2f} C in its last {:.0f} min, about {:+.2f} C to come (settled: {:.2f} C)",
                    end.moved_C, options.apart_min, end.still_to_come_C, options.settled_C);
    return end;
}

}  // namespace thermbal
