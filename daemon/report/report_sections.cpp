#include "report_sections.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "report/html.hpp"

namespace thermbal {
namespace {

bool is_declared(const ReportChannel& channel) {
    return channel.verdict && channel.verdict->declared();
}

/// Where a channel goes: its steady state where that is declared, else where it is.
double end_C(const TestReport& report, const ReportChannel& channel) {
    if (is_declared(channel)) return channel.verdict->steady_state_C;
    const Column* const measured = report.measured(channel);
    return measured == nullptr ? no_value : last_good(measured->values);
}

double rise_C(const TestReport& report, const ReportChannel& channel) {
    const Column* const measured = report.measured(channel);
    return measured == nullptr ? no_value : end_C(report, channel) - first_good(measured->values);
}

const char* class_of_state(const ReportChannel& channel) {
    if (channel.is_ambient || !channel.verdict) return "quiet";
    switch (channel.verdict->state) {
        case ChannelState::declared:
            return "good";
        case ChannelState::stuck:
        case ChannelState::dead:
            return "bad";
        case ChannelState::measuring:
        case ChannelState::barely_warming:
            break;
    }
    return "quiet";
}

std::string interval(const ChannelVerdict& verdict) {
    return std::isfinite(verdict.steady_state_low_C)
               ? fmt::format("{:.2f} &ndash; {:.2f}", verdict.steady_state_low_C, verdict.steady_state_high_C)
               : "-";
}

/// With the room's temperature that the steady state is said for: it may have moved since.
std::string declared_at(const ChannelVerdict& verdict) {
    const std::string room =
        std::isfinite(verdict.room_C) ? fmt::format(", room at {:.2f} &deg;C", verdict.room_C) : "";
    return fmt::format("declared at {}{}", duration(verdict.declared_at_min), room);
}

std::string channel_row(const TestReport& report, const ReportChannel& channel) {
    const Column* const measured = report.measured(channel);
    const ChannelVerdict none;
    const ChannelVerdict& verdict = channel.verdict ? *channel.verdict : none;
    const bool declared = is_declared(channel);
    const std::string settles = degrees(verdict.steady_state_C);
    return fmt::format(
        R"(<tr><td><b>{}</b><small class="phone">{}</small></td><td class="place wide">{}</td><td class="number wide">{}</td><td class="number wide">{}</td><td class="number">{}</td><td class="number">{}</td><td class="number wide">{}</td><td class="number wide">{}</td><td class="number wide">{}</td><td class="{}">{}</td></tr>)",
        escaped(channel.name), escaped(channel.place), escaped(channel.place),
        degrees(measured == nullptr ? no_value : last_good(measured->values)),
        degrees(rise_C(report, channel)),
        declared ? "<b>" + settles + "</b>" : "<span class=\"quiet\">" + settles + "</span>",
        interval(verdict), duration(verdict.equilibrium_time_min),
        verdict.n > 0 ? std::to_string(verdict.n) : "-",
        std::isfinite(verdict.window_rmse_C) ? fmt::format("{:.3f}", verdict.window_rmse_C) : "-",
        class_of_state(channel), declared ? declared_at(verdict) : state_of(channel));
}

std::string quality_name(Quality quality) {
    std::string name(to_string(quality));
    std::ranges::replace(name, '_', ' ');
    return name;
}

/// One bar a channel over the test, a mark wherever a sample is not good; a mark is at least a pixel wide.
std::string quality_strip(const TestReport& report) {
    constexpr double left = 60.0, width = 900.0, row_px = 15.0;
    const double height = row_px * static_cast<double>(report.channels.size()) + 4.0;
    const double scans = std::max<double>(1.0, static_cast<double>(report.window.scans));
    std::string svg = fmt::format(
        R"(<svg viewBox="0 0 {0:.0f} {1:.0f}" width="100%" role="img" aria-label="quality of every sample">)",
        left + width, height);
    double y = 2.0;
    for (const ReportChannel& channel : report.channels) {
        svg += fmt::format(
            R"html(<text x="{:.0f}" y="{:.0f}" text-anchor="end">{}</text><rect x="{:.0f}" y="{:.1f}" width="{:.0f}" height="{:.1f}" style="fill:var(--good)" fill-opacity=".35"/>)html",
            left - 8, y + 10, escaped(channel.name), left, y + 1, width, row_px - 4);
        const std::vector<Quality>& quality = channel.quality;
        double drawn_to = 0.0;
        for (std::size_t from = 0, to = 0; from < quality.size(); from = to) {
            to = from + 1;
            while (to < quality.size() && quality[to] == quality[from]) ++to;
            if (quality[from] == Quality::good) continue;
            const double at = static_cast<double>(from) / scans * width;
            const double end = std::max(static_cast<double>(to) / scans * width, at + 1.0);
            if (end <= drawn_to) continue;  // within a pixel that is marked already
            drawn_to = end;
            svg += fmt::format(
                R"html(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" style="fill:var(--{})"><title>{}</title></rect>)html",
                left + at, y + 1, end - at, row_px - 4, quality[from] == Quality::gap ? "warn" : "bad",
                quality_name(quality[from]));
        }
        y += row_px;
    }
    return svg + "</svg>";
}

/// Of the table of qualities: a recording has neither, a daemon's test may have no calibration.
struct QualityColumns {
    bool read_at = false;
    bool calibration = false;
};

std::string quality_head(const QualityColumns& columns) {
    return fmt::format(
        R"(<tr><th></th>{}<th class="number">samples</th><th class="number">good</th><th>not good</th>{}</tr>)",
        columns.read_at ? R"(<th class="wide">read at</th>)" : "",
        columns.calibration ? R"(<th class="wide">calibration</th>)" : "");
}

std::string wide_cell(bool shown, std::string_view text) {
    return shown ? fmt::format(R"(<td class="wide">{}</td>)", escaped(text)) : std::string();
}

std::string quality_row(const ReportChannel& channel, const QualityColumns& columns) {
    std::size_t good = 0;
    std::string others;
    for (const auto& [quality, count] : quality_counts(channel)) {
        if (quality == Quality::good) {
            good = count;
        } else {
            others += fmt::format("{}{} {}", others.empty() ? "" : ", ", count, quality_name(quality));
        }
    }
    const double share = channel.quality.empty() ? 0.0
                                                 : 100.0 * static_cast<double>(good) /
                                                       static_cast<double>(channel.quality.size());
    return fmt::format(
        R"(<tr><td><b>{}</b></td>{}<td class="number">{}</td><td class="number">{:.1f} %</td><td class="{}">{}</td>{}</tr>)",
        escaped(channel.name), wide_cell(columns.read_at, channel.source), channel.quality.size(), share,
        others.empty() ? "quiet" : "warn", others.empty() ? "none" : others,
        wide_cell(columns.calibration, channel.calibration));
}

Plot warm_up_plot(const TestReport& report, const ReportChannel& channel, double unit_s) {
    Plot plot{.id = "",
              .title = "Warm-up",
              .table = "course",
              .unit = "°C",
              .lines = {{"measured", channel.name, "ink"}}};
    if (!channel.regression_C.empty())
        plot.lines.push_back({"SVR free run", channel.name + " regression", "c1", PlotLine::Stroke::dashed});
    if (!channel.expected_C.empty()) plot.lines.push_back({"expected", channel.name + " expected", "accent"});
    if (!channel.verdict) return plot;
    const ChannelVerdict& verdict = *channel.verdict;
    const double known_s = verdict.window_end_min * 60.0;
    if (std::isfinite(verdict.steady_state_low_C)) {
        plot.strips.push_back({known_s / unit_s, report.time_s.back() / unit_s, verdict.steady_state_low_C,
                               verdict.steady_state_high_C});
    }
    plot.marks.push_back({known_s / unit_s, verdict.declared() ? "declared" : "newest window"});
    return plot;
}

Plot error_plot(const ReportChannel& channel, double unit_s) {
    Plot plot{.id = "",
              .title = "Measured less predicted",
              .table = "course",
              .unit = "°C",
              .lines = {},
              .height_px = 150};
    if (!channel.regression_C.empty())
        plot.lines.push_back({"less SVR", channel.name + " regression error", "c1"});
    plot.lines.push_back({"less expected", channel.name + " error", "accent"});
    if (channel.verdict) plot.marks.push_back({channel.verdict->window_end_min * 60.0 / unit_s, ""});
    return plot;
}

Plot rmse_plot(const ReportChannel& channel) {
    return {.id = "",
            .title = "RMSE against n",
            .table = "rmse",
            .unit = "°C",
            .lines = {{"RMSE of the window", channel.name, "ink"},
                      {fmt::format("chosen, n = {}", channel.verdict->n), channel.name + " chosen", "accent",
                       PlotLine::Stroke::dots}},
            .height_px = 220};
}

std::string channel_sentence(const ReportChannel& channel) {
    if (!channel.verdict) return "Not identified.";
    const ChannelVerdict& verdict = *channel.verdict;
    if (!verdict.declared()) return escaped(verdict.reason);
    std::string sentence = fmt::format(
        "Settles at <b>{:.2f} &deg;C</b> (90 % between {:.2f} and {:.2f}), 95 % of the rise at {}; declared "
        "at {}.",
        verdict.steady_state_C, verdict.steady_state_low_C, verdict.steady_state_high_C,
        duration(verdict.equilibrium_time_min), duration(verdict.declared_at_min));
    if (std::isfinite(verdict.svr.steady_state_C))
        sentence += fmt::format(" The support-vector regression by itself says {:.2f} &deg;C.",
                                verdict.svr.steady_state_C);
    return sentence;
}

std::string guards_list(const ChannelVerdict& verdict) {
    std::string html = "<details><summary>How it was proved</summary><table>";
    for (const Guard& guard : verdict.guards) {
        std::string name = guard.name;
        std::ranges::replace(name, '_', ' ');
        html += fmt::format(R"(<tr><td class="{}">{}</td><td>{}</td><td>{}</td></tr>)",
                            guard.passed ? "good" : "bad", guard.passed ? "holds" : "fails", escaped(name),
                            escaped(guard.figures));
    }
    return html + "</table></details>";
}

}  // namespace

std::string degrees(double value_C, int digits) {
    return std::isfinite(value_C) ? fmt::format("{:.{}f}", value_C, digits) : "-";
}

std::string duration(double minutes) {
    if (!std::isfinite(minutes)) return "-";
    return std::abs(minutes) < 600.0 ? fmt::format("{:.0f}&nbsp;min", minutes)
                                     : fmt::format("{:.1f}&nbsp;h", minutes / 60.0);
}

std::vector<std::pair<Quality, std::size_t>> quality_counts(const ReportChannel& channel) {
    std::array<std::size_t, static_cast<std::size_t>(Quality::gap) + 1> counts{};
    for (const Quality quality : channel.quality) ++counts.at(static_cast<std::size_t>(quality));
    std::vector<std::pair<Quality, std::size_t>> occurring;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (counts.at(i) > 0) occurring.emplace_back(static_cast<Quality>(i), counts.at(i));
    }
    return occurring;
}

std::string state_of(const ReportChannel& channel) {
    if (channel.is_ambient) return "room";
    if (!channel.verdict) return "-";
    std::string state(to_string(channel.verdict->state));
    std::ranges::replace(state, '_', ' ');
    return channel.withdrawn.empty() || channel.verdict->declared() ? state
                                                                    : state + ", a declaration withdrawn";
}

std::string channel_table(const TestReport& report) {
    std::string html =
        R"(<h2>Channels</h2><div class="scroll"><table><thead><tr><th></th><th class="wide">place</th><th class="number wide">last &deg;C</th><th class="number wide">rise &deg;C</th><th class="number">settles at &deg;C</th><th class="number">90 % between</th><th class="number wide">95 % at</th><th class="number wide">n</th><th class="number wide">RMSE &deg;C</th><th>state</th></tr></thead><tbody>)";
    for (const ReportChannel& channel : report.channels) html += channel_row(report, channel);
    return html + "</tbody></table></div>";
}

std::string overview_section(const TestReport& report, Page& page) {
    Plot plot{.id = "overview",
              .title = "All channels",
              .table = "course",
              .unit = "°C",
              .lines = {},
              .height_px = 420,
              .label_lines = true};
    for (const ReportChannel& channel : report.channels) {
        plot.lines.push_back({channel.name, channel.name, channel.is_ambient ? "muted" : "ink",
                              channel.is_ambient ? PlotLine::Stroke::dashed : PlotLine::Stroke::solid});
    }
    return "<h2>Warm-up</h2><div class=\"card\">" + page.figure(plot) +
           "<p class=\"screen\"><small>Drag to zoom, double click to see all again; with two fingers on a "
           "phone.</small></p></div>";
}

std::string sensor_map(const TestReport& report) {
    double most_C = 0.0;
    for (const ReportChannel& channel : report.channels) most_C = std::fmax(most_C, rise_C(report, channel));
    std::vector<const ReportChannel*> by_heat;
    by_heat.reserve(report.channels.size());
    for (const ReportChannel& channel : report.channels) by_heat.push_back(&channel);
    std::ranges::stable_sort(by_heat, [&](const ReportChannel* a, const ReportChannel* b) {
        const double left_C = rise_C(report, *a), right_C = rise_C(report, *b);
        return std::isfinite(left_C) && (!std::isfinite(right_C) || left_C > right_C);
    });
    std::string html = "<h2>Where the heat is</h2><div class=\"map\">";
    for (const ReportChannel* const channel : by_heat) {
        const double rise = rise_C(report, *channel);
        constexpr double strongest_tint = 0.42;
        const double heat =
            std::isfinite(rise) && most_C > 0 ? strongest_tint * std::clamp(rise / most_C, 0.0, 1.0) : 0.0;
        html += fmt::format(
            R"(<div class="tile" style="--heat:{:.2f}"><span class="name">{}</span><span>{}</span><b>{} &deg;C</b><span>{}</span></div>)",
            heat, escaped(channel->name), channel->place.empty() ? "&nbsp;" : escaped(channel->place),
            degrees(end_C(report, *channel), 1),
            channel->is_ambient
                ? std::string("the room")
                : fmt::format("{:+.1f} &deg;C {}", rise, is_declared(*channel) ? "in all" : "so far"));
    }
    return html + "</div>";
}

std::string channel_section(const TestReport& report, const ReportChannel& channel, Page& page) {
    const double unit_s = time_unit(report.time_s.empty() ? 0.0 : report.time_s.back()).second;
    const auto index = static_cast<std::size_t>(&channel - report.channels.data());
    const auto figure = [&](Plot plot, const char* kind) {
        plot.id = fmt::format("channel{}-{}", index, kind);
        return page.figure(plot);
    };
    std::string html = fmt::format(R"(<section class="channel"><h3>{} <small>{}</small></h3><p>{}</p>)",
                                   escaped(channel.name), escaped(channel.place), channel_sentence(channel));
    if (!channel.withdrawn.empty())
        html += fmt::format(R"(<p class="warn">An earlier declaration was withdrawn: {}</p>)",
                            escaped(channel.withdrawn));
    if (!channel.no_course.empty())
        html += fmt::format(R"(<p class="quiet">{}</p>)", escaped(channel.no_course));
    html += "<div class=\"pair\"><div>" + figure(warm_up_plot(report, channel, unit_s), "course");
    if (!channel.expected_C.empty() || !channel.regression_C.empty())
        html += figure(error_plot(channel, unit_s), "error");
    html += "</div><div>";
    if (channel.verdict && !channel.verdict->rmse_by_n_C.empty()) html += figure(rmse_plot(channel), "rmse");
    if (channel.verdict && !channel.verdict->guards.empty()) html += guards_list(*channel.verdict);
    return html + "</div></div></section>";
}

std::string quality_section(const TestReport& report) {
    std::string html = "<h2>Data quality</h2><p>";
    std::size_t scans = 0;
    std::string how;
    for (const auto& [status, count] : report.scans) {
        scans += count;
        how += fmt::format("{}{} {}", how.empty() ? "" : ", ", count, escaped(status));
    }
    html += fmt::format(
        "{} scans, one each {:.6g} s{}. A reading that did not come from the sensor is marked and never "
        "used as a number.</p><div class=\"card\">{}</div>",
        scans, report.window.period_s, how.empty() ? "" : ": " + how, quality_strip(report));
    const auto says = [&](const std::string ReportChannel::* text) {
        return std::ranges::any_of(report.channels,
                                   [text](const ReportChannel& channel) { return !(channel.*text).empty(); });
    };
    const QualityColumns columns{.read_at = says(&ReportChannel::source),
                                 .calibration = says(&ReportChannel::calibration)};
    html += fmt::format(R"(<div class="scroll"><table><thead>{}</thead><tbody>)", quality_head(columns));
    for (const ReportChannel& channel : report.channels) html += quality_row(channel, columns);
    return html + "</tbody></table></div>";
}

std::string events_section(const TestReport& report) {
    if (report.events.empty()) return {};
    std::string html = "<h2>Events</h2>";
    if (report.has_older_events)
        html += fmt::format("<p>The newest {}; older ones are in the database.</p>", report.events.size());
    html +=
        R"(<div class="scroll"><table class="events"><thead><tr><th class="number">min</th><th class="wide">what</th><th>channel</th><th></th></tr></thead><tbody>)";
    for (const ReportEvent& event : report.events) {
        std::string kind = event.kind;
        std::ranges::replace(kind, '_', ' ');
        html += fmt::format(
            R"(<tr><td class="number">{}</td><td class="wide">{}</td><td>{}</td><td>{}</td></tr>)",
            event.time_min ? fmt::format("{:.2f}", *event.time_min) : "-", escaped(kind),
            escaped(event.channel), escaped(event.message));
    }
    return html + "</tbody></table></div>";
}

std::string provenance_section(const TestReport& report) {
    std::string html = "<h2>Where this comes from</h2><div class=\"card\"><dl>";
    html += fmt::format(
        "<dt>source</dt><dd>{}</dd><dt>asked for</dt><dd>a 90 % interval within &plusmn;{:.6g} &deg;C, or "
        "{:.3g} % of the rise where that is more</dd>",
        escaped(report.source), report.tolerance_C, 100.0 * report.tolerance_share_of_rise);
    for (const auto& [what, version] : report.versions)
        html += fmt::format("<dt>{}</dt><dd>{}</dd>", escaped(what), escaped(version));
    html +=
        "</dl><p class=\"quiet\">A steady state is the temperature at which a channel settles while the room "
        "stays at its "
        "mean over the last 15 min of the window. Expected: from the time constants that all channels share, "
        "with their central "
        "90 % interval. SVR: the support-vector regression over n lags of Feng, Xia, Sun and Fu (2015), run "
        "freely; its RMSE "
        "against n is their Fig. 5, the course and its error their Figs. 6 and 7.</p></div>";
    if (!report.configuration.empty())
        html += fmt::format("<details><summary>Configuration in effect</summary><pre>{}</pre></details>",
                            escaped(report.configuration));
    return html;
}

}  // namespace thermbal
