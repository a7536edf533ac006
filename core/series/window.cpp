#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "base/median.hpp"
#include "series/recorded_test.hpp"
#include "series/sample.hpp"

namespace thermbal {
namespace {

const Column* find_column(const std::vector<Column>& columns, std::string_view name) {
    const auto found = std::ranges::find(columns, name, &Column::name);
    return found == columns.end() ? nullptr : &*found;
}

TestWindow slice(const TestWindow& window, std::size_t first, std::size_t count) {
    TestWindow part{window.time_s(first), window.period_s, count, {}, {}};
    const auto cut = [&](const Column& column) {
        const auto from = column.values.begin() + static_cast<std::ptrdiff_t>(first);
        return Column{column.name, {from, from + static_cast<std::ptrdiff_t>(count)}};
    };
    for (const Column& column : window.channels) part.channels.push_back(cut(column));
    for (const Column& column : window.inputs) part.inputs.push_back(cut(column));
    return part;
}

/// Times on the grid come out of a product; a scan exactly at the limit must not be lost to rounding.
constexpr double grid_slack = 1e-6;

}  // namespace

const Column* TestWindow::channel(std::string_view channel_name) const {
    return find_column(channels, channel_name);
}

const Column* TestWindow::input(std::string_view input_name) const {
    return find_column(inputs, input_name);
}

std::size_t TestWindow::scans_until(double until_s) const {
    const double count = std::floor((until_s - start_s) / period_s + grid_slack) + 1.0;
    if (!(count > 0.0)) return 0;  // NaN, too
    return static_cast<std::size_t>(std::clamp(count, 0.0, static_cast<double>(scans)));
}

double median_step_s(const RecordedTest& test) {
    if (test.time_s.size() < 2) return 0.0;
    std::vector<double> steps;
    steps.reserve(test.time_s.size() - 1);
    for (std::size_t i = 1; i < test.time_s.size(); ++i) steps.push_back(test.time_s[i] - test.time_s[i - 1]);
    return upper_median(std::move(steps));
}

TestWindow to_window(const RecordedTest& test, double period_s) {
    TestWindow window;
    window.period_s = period_s;
    if (test.time_s.empty()) return window;
    window.start_s = test.time_s.front();
    const auto scan_of = [&](std::size_t row) {
        return static_cast<std::size_t>(std::llround((test.time_s[row] - window.start_s) / period_s));
    };
    window.scans = scan_of(test.time_s.size() - 1) + 1;
    for (const Column& column : test.channels) {
        Column on_grid{column.name, std::vector<double>(window.scans, no_value)};
        std::vector<int> rows(window.scans, 0);
        for (std::size_t row = 0; row < column.values.size(); ++row) {
            if (!std::isfinite(column.values[row])) continue;
            double& value = on_grid.values[scan_of(row)];
            int& count = rows[scan_of(row)];
            value = count == 0 ? column.values[row] : (value * count + column.values[row]) / (count + 1);
            ++count;
        }
        window.channels.push_back(std::move(on_grid));
    }
    for (const Column& column : test.inputs) {
        Column on_grid{column.name, std::vector<double>(window.scans, no_value)};
        for (std::size_t row = 0; row < column.values.size(); ++row) {
            if (std::isfinite(column.values[row])) on_grid.values[scan_of(row)] = column.values[row];
        }
        for (std::size_t scan = 1; scan < window.scans; ++scan) {
            if (!std::isfinite(on_grid.values[scan])) on_grid.values[scan] = on_grid.values[scan - 1];
        }
        window.inputs.push_back(std::move(on_grid));
    }
    return window;
}

RecordedTest recording_of(const TestWindow& window) {
    RecordedTest test{{}, window.channels, window.inputs};
    test.time_s.reserve(window.scans);
    for (std::size_t scan = 0; scan < window.scans; ++scan) test.time_s.push_back(window.time_s(scan));
    return test;
}

TestWindow window_until(const TestWindow& window, double until_s) {
    return slice(window, 0, window.scans_until(until_s));
}

TestWindow window_from(const TestWindow& window, double from_s) {
    const double skipped = std::ceil((from_s - window.start_s) / window.period_s - grid_slack);
    const std::size_t first = skipped < static_cast<double>(window.scans)
                                  ? static_cast<std::size_t>(std::max(skipped, 0.0))
                                  : window.scans;
    return slice(window, first, window.scans - first);
}

TestWindow coarsened(const TestWindow& window, std::size_t most_scans) {
    if (window.scans <= most_scans || most_scans == 0) return window;
    const std::size_t group = (window.scans + most_scans - 1) / most_scans;
    const auto scans_of = static_cast<double>(group);
    TestWindow coarse{window.start_s + 0.5 * (scans_of - 1.0) * window.period_s,
                      scans_of * window.period_s,
                      window.scans / group,
                      {},
                      {}};
    for (const Column& column : window.channels) {
        std::vector<double>& means = coarse.channels.emplace_back(Column{column.name, {}}).values;
        for (std::size_t k = 0; k < coarse.scans; ++k)
            means.push_back(mean_of_good(std::span(column.values).subspan(k * group, group)));
    }
    for (const Column& column : window.inputs) {
        std::vector<double>& newest = coarse.inputs.emplace_back(Column{column.name, {}}).values;
        for (std::size_t k = 0; k < coarse.scans; ++k) newest.push_back(column.values[(k + 1) * group - 1]);
    }
    return coarse;
}

}  // namespace thermbal
