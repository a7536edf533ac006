#include "report_courses.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <ranges>

#include <fmt/format.h>

#include "declaration/course.hpp"

namespace thermbal {
namespace {

/// The window's scans, and `points` times from its end to a little after the last channel is in balance.
std::vector<double> times_of(const TestReport& report) {
    constexpr std::size_t points = 120;
    constexpr double past_balance = 1.15, most_beyond_s = 24.0 * 3600.0;
    const TestWindow& window = report.window;
    std::vector<double> time_s;
    time_s.reserve(window.scans + points);
    for (std::size_t scan = 0; scan < window.scans; ++scan) time_s.push_back(window.time_s(scan));
    double until_s = window.end_s();
    for (const ReportChannel& channel : report.channels) {
        if (channel.verdict && channel.verdict->declared())
            until_s = std::fmax(until_s, past_balance * channel.verdict->equilibrium_time_min * 60.0);
    }
    until_s = std::min(until_s, window.end_s() + most_beyond_s);
    const double beyond_s = until_s - window.end_s();
    if (beyond_s < window.period_s) return time_s;
    const double step_s = beyond_s / static_cast<double>(points);
    for (std::size_t i = 1; i <= points; ++i)
        time_s.push_back(window.end_s() + static_cast<double>(i) * step_s);
    return time_s;
}

void take_expected(ReportChannel& channel, const Result<std::vector<ExpectedCourse>>& courses) {
    constexpr double same_C = 0.005;
    if (!courses) {
        channel.no_course = "There is no expected course: " + courses.error().message + ".";
        return;
    }
    const auto found = std::ranges::find(*courses, channel.name, &ExpectedCourse::channel);
    if (found == courses->end() || !std::isfinite(channel.verdict->steady_state_C)) return;
    if (!(std::abs(found->steady_state_C - channel.verdict->steady_state_C) <= same_C)) {
        channel.no_course =
            "Its expected course is not drawn: the samples alone do not lead to what was declared, earlier "
            "tests of "
            "the machine or another version of the program took part in it.";
        return;
    }
    channel.expected_C = found->temperature_C;
}

void take_regression(ReportChannel& channel, const TestWindow& window, const std::vector<double>& time_s,
                     const VerdictCourses& courses) {
    const SvrPrediction& svr = channel.verdict->svr;
    if (svr.n < 1 || !std::isfinite(svr.C)) return;
    const auto beyond = static_cast<std::size_t>(
        std::max(0.0, std::ceil((time_s.back() - window.end_s()) / window.period_s) + 1.0));
    const auto course = courses.regression(svr, channel.name, beyond);
    if (!course) return;
    channel.regression_C.assign(time_s.size(), no_value);
    for (std::size_t i = 0; i < time_s.size(); ++i) {
        const double at = std::round((time_s[i] - course->first_s) / course->period_s);
        if (at >= 0.0 && at < static_cast<double>(course->temperature_C.size()))
            channel.regression_C[i] = course->temperature_C[static_cast<std::size_t>(at)];
    }
}

}  // namespace

void add_courses(TestReport& report, const FlowOptions& flow, const ParallelFor& parallel_for) {
    report.time_s = times_of(report);
    std::map<double, std::vector<ReportChannel*>> by_window;
    for (ReportChannel& channel : report.channels) {
        if (channel.verdict && std::isfinite(channel.verdict->window_end_min))
            by_window[channel.verdict->window_end_min].push_back(&channel);
    }
    const std::vector<std::pair<double, std::vector<ReportChannel*>>> windows(by_window.begin(),
                                                                              by_window.end());
    parallel_for(windows.size(), [&](std::size_t i) {
        const auto& [end_min, channels] = windows[i];
        const TestWindow window = window_until(report.window, end_min * 60.0 + 0.5 * report.window.period_s);
        const VerdictCourses courses(window, flow);
        const auto expected = courses.expected(report.time_s);
        for (ReportChannel* const channel : channels) {
            take_expected(*channel, expected);
            take_regression(*channel, window, report.time_s, courses);
        }
    });
}

}  // namespace thermbal
