#include "report/test_report.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "report/page.hpp"
#include "report/verdict_json.hpp"
#include "report_sections.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

std::vector<double> less(const std::vector<double>& measured, const std::vector<double>& course) {
    std::vector<double> difference(measured.size(), no_value);
    for (std::size_t i = 0; i < std::min(measured.size(), course.size()); ++i)
        difference[i] = rounded(measured[i] - course[i]);
    return difference;
}

PlotTable course_table(const TestReport& report) {
    const auto [unit, unit_s] = time_unit(report.time_s.empty() ? 0.0 : report.time_s.back());
    PlotTable table{"course", unit, {}, {}};
    for (const double time_s : report.time_s) table.x.push_back(rounded(time_s / unit_s));
    for (const ReportChannel& channel : report.channels) {
        const Column* const found = report.measured(channel);
        std::vector<double> measured_C = found == nullptr ? std::vector<double>{} : found->values;
        measured_C.resize(report.time_s.size(), no_value);
        if (!channel.expected_C.empty()) {
            table.columns.push_back({channel.name + " expected", rounded(channel.expected_C)});
            table.columns.push_back({channel.name + " error", less(measured_C, channel.expected_C)});
        }
        if (!channel.regression_C.empty()) {
            table.columns.push_back({channel.name + " regression", rounded(channel.regression_C)});
            table.columns.push_back(
                {channel.name + " regression error", less(measured_C, channel.regression_C)});
        }
        table.columns.push_back({channel.name, std::move(measured_C)});
    }
    return thinned(std::move(table), pixels_of_a_screen);
}

PlotTable rmse_table(const TestReport& report) {
    PlotTable table{"rmse", "n", {}, {}};
    std::size_t longest = 0;
    for (const ReportChannel& channel : report.channels) {
        if (channel.verdict) longest = std::max(longest, channel.verdict->rmse_by_n_C.size());
    }
    for (std::size_t n = 1; n <= longest; ++n) table.x.push_back(static_cast<double>(n));
    for (const ReportChannel& channel : report.channels) {
        if (!channel.verdict || channel.verdict->rmse_by_n_C.empty()) continue;
        std::vector<double> rmse_C = channel.verdict->rmse_by_n_C;
        rmse_C.resize(longest, no_value);
        const int n = channel.verdict->n;
        std::vector<double> chosen(longest, no_value);
        if (n > 0 && static_cast<std::size_t>(n) <= longest)
            chosen[static_cast<std::size_t>(n) - 1] = rmse_C[static_cast<std::size_t>(n) - 1];
        table.columns.push_back({channel.name, std::move(rmse_C)});
        table.columns.push_back({channel.name + " chosen", std::move(chosen)});
    }
    return table;
}

json channel_to_json(const ReportChannel& channel) {
    json entry = channel.verdict ? verdict_to_json(*channel.verdict) : json{{"channel", channel.name}};
    entry["place"] = channel.place;
    entry["role"] = channel.is_ambient ? "ambient" : "structure";
    entry["required"] = channel.required;
    entry["source"] = channel.source;
    entry["calibration"] = channel.calibration;
    entry["withdrawn"] = channel.withdrawn;
    json samples = json::object();
    for (const auto& [quality, count] : quality_counts(channel))
        samples[std::string(to_string(quality))] = count;
    entry["samples"] = std::move(samples);
    return entry;
}

json answer_to_json(const TestAnswer& answer) {
    constexpr const char* kinds[] = {"declared", "open", "none"};
    return {{"kind", kinds[static_cast<int>(answer.kind)]},
            {"declared_channels", answer.declared},
            {"waited_for_channels", answer.waited_for},
            {"slowest_channel", answer.slowest},
            {"balance_min", number_or_null(answer.balance_min)},
            {"balance_low_min", number_or_null(answer.balance_low_min)},
            {"balance_high_min", number_or_null(answer.balance_high_min)},
            {"known_min", number_or_null(answer.known_min)},
            {"saved_min", number_or_null(answer.saved_min())},
            {"widest_half_C", number_or_null(answer.widest_half_C)},
            {"undecided", answer.undecided}};
}

bool is_waited_for(const ReportChannel& channel) {
    const bool barely = channel.verdict && channel.verdict->state == ChannelState::barely_warming;
    return channel.required && !channel.is_ambient && !barely;
}

void take_declared(TestAnswer& answer, const ChannelVerdict& verdict) {
    ++answer.declared;
    answer.known_min = std::fmax(answer.known_min, verdict.declared_at_min);
    answer.widest_half_C =
        std::fmax(answer.widest_half_C, 0.5 * (verdict.steady_state_high_C - verdict.steady_state_low_C));
    const bool is_later = !(verdict.equilibrium_time_min <= answer.balance_min);
    if (!std::isfinite(verdict.equilibrium_time_min) || !is_later) return;
    answer.slowest = verdict.channel;
    answer.balance_min = verdict.equilibrium_time_min;
    answer.balance_low_min = verdict.equilibrium_time_low_min;
    answer.balance_high_min = verdict.equilibrium_time_high_min;
}

}  // namespace

TestAnswer answer_of(const TestReport& report) {
    TestAnswer answer;
    for (const ReportChannel& channel : report.channels) {
        if (!is_waited_for(channel)) continue;
        ++answer.waited_for;
        if (channel.verdict && channel.verdict->declared()) {
            take_declared(answer, *channel.verdict);
        } else {
            answer.undecided.push_back(channel.name + ": " +
                                       (channel.verdict ? channel.verdict->reason : "not identified yet"));
        }
    }
    if (answer.declared > 0)
        answer.kind = answer.undecided.empty() ? TestAnswer::Kind::declared : TestAnswer::Kind::open;
    return answer;
}

std::vector<PlotTable> report_tables(const TestReport& report) {
    return {course_table(report), rmse_table(report)};
}

json report_to_json(const TestReport& report) {
    json channels = json::array(), events = json::array(), scans = json::object(), tables = json::object(),
         versions = json::object();
    for (const ReportChannel& channel : report.channels) channels.push_back(channel_to_json(channel));
    for (const ReportEvent& event : report.events) {
        events.push_back({{"time_min", event.time_min ? json(*event.time_min) : json(nullptr)},
                          {"kind", event.kind},
                          {"channel", event.channel},
                          {"message", event.message}});
    }
    for (const auto& [status, count] : report.scans) scans[status] = count;
    for (const PlotTable& table : report_tables(report)) tables[table.name] = table_to_json(table);
    for (const auto& [what, version] : report.versions) versions[what] = version;
    return {{"name", report.name},
            {"machine", report.machine},
            {"source", report.source},
            {"started", report.started},
            {"state", report.state},
            {"end_reason", report.end_reason},
            {"period_s", report.window.period_s},
            {"tolerance_C", report.tolerance_C},
            {"answer", answer_to_json(answer_of(report))},
            {"channels", std::move(channels)},
            {"scans", std::move(scans)},
            {"events", std::move(events)},
            {"has_older_events", report.has_older_events},
            {"tables", std::move(tables)},
            {"configuration", report.configuration},
            {"versions", std::move(versions)}};
}

std::string report_to_html(const TestReport& report) {
    Page page(report.name.empty() ? report.source : report.name);
    for (PlotTable& table : report_tables(report)) page.add_table(std::move(table));
    page.add(verdict_section(report, answer_of(report)));
    page.add(channel_table(report));
    page.add(overview_section(report, page));
    page.add(sensor_map(report));
    page.add("<h2>Each channel</h2>");
    for (const ReportChannel& channel : report.channels) {
        if (!channel.is_ambient) page.add(channel_section(report, channel, page));
    }
    page.add(quality_section(report));
    page.add(events_section(report));
    page.add(provenance_section(report));
    return page.html();
}

}  // namespace thermbal
