#include "report_command.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "compute/threads.hpp"
#include "files.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "replay.hpp"
#include "report/assets.hpp"
#include "report_courses.hpp"
#include "version.hpp"

namespace thermbal {
namespace {

/// A test's id, if it is one and not a file's name.
std::optional<TestId> test_id_in(const std::string& what) {
    TestId id = 0;
    const auto [end, trouble] = std::from_chars(what.data(), what.data() + what.size(), id);
    const bool whole = trouble == std::errc() && end == what.data() + what.size();
    return whole && id > 0 ? std::optional(id) : std::nullopt;
}

std::vector<Quality> quality_of(const Column& column) {
    std::vector<Quality> quality;
    quality.reserve(column.values.size());
    for (const double value : column.values)
        quality.push_back(std::isfinite(value) ? Quality::good : Quality::gap);
    return quality;
}

/// The figures of a declaration that still stands.
std::string declared_as(const Replay& done, const ReplayChange& declared) {
    const auto found = std::ranges::find(done.channels, declared.change.channel, &ChannelVerdict::channel);
    if (found == done.channels.end() || found->declared_at_min != declared.at_min)
        return declared.change.reason;
    return fmt::format("settles at {:.2f} C ({:.2f} to {:.2f} C), 95 % of the rise at {:.0f} min",
                       found->steady_state_C, found->steady_state_low_C, found->steady_state_high_C,
                       found->equilibrium_time_min);
}

void add_replay(TestReport& report, const Replay& done) {
    for (ReportChannel& channel : report.channels) {
        const auto found = std::ranges::find(done.channels, channel.name, &ChannelVerdict::channel);
        if (found != done.channels.end()) channel.verdict = *found;
    }
    for (const ReplayChange& one : done.changes) {
        const bool declared = one.change.kind == DeclarationChange::Kind::declared;
        report.events.push_back({one.at_min, std::string(to_string(one.change.kind)), one.change.channel,
                                 declared ? declared_as(done, one) : one.change.reason});
    }
    report.end_reason =
        std::isfinite(done.stopped_at_min)
            ? fmt::format("A recording: the live flow stops this test at {:.2f} of {:.2f} min: {}.",
                          done.stopped_at_min, report.window.end_s() / 60.0, done.decision.reason)
            : fmt::format("A recording: the live flow does not stop this test within {:.2f} min: {}.",
                          report.window.end_s() / 60.0, done.decision.reason);
}

Result<TestReport> wanted_report(const ReportOptions& options) {
    const auto id = test_id_in(options.what);
    if (!options.what.empty() && !id) return report_of_recording(options);
    const auto reader = open_database(options.database);
    if (!reader) return std::unexpected(reader.error());
    const auto wanted = wanted_test(*reader, id);
    if (!wanted) return std::unexpected(wanted.error());
    return report_of_test(*reader, *wanted, options);
}

}  // namespace

Result<TestReport> report_of_recording(const ReportOptions& options) {
    auto input = read_input(options.recording);
    if (!input) return std::unexpected(input.error());
    std::optional<Progress> progress("report");
    const auto done = replay(*input, options.recording, [](const ReplayChange&) {}, *progress);
    progress.reset();
    if (!done) return std::unexpected(done.error());
    TestReport report{.name = "",
                      .machine = options.recording.machine,
                      .source = options.recording.file,
                      .state = "recording",
                      .tolerance_C = options.recording.tolerance_C};
    for (const Column& column : input->window.channels) {
        const bool is_ambient = column.name == input->flow.ambient;
        report.channels.push_back({.name = column.name,
                                   .is_ambient = is_ambient,
                                   .required = !is_ambient,
                                   .quality = quality_of(column)});
    }
    report.tolerance_share_of_rise = input->flow.tolerance_share_of_rise;
    report.window = std::move(input->window);
    add_replay(report, *done);
    add_courses(report, input->flow, parallel_on_threads(options.recording.threads, false));
    return report;
}

int run_report(const ReportOptions& options) {
    auto report = wanted_report(options);
    if (!report) return report_error(report.error());
    report->versions.emplace_back("report by", std::string("thermbalctl ") + version);
    report->versions.emplace_back("plots by", std::string(dygraphs_version()) + ", MIT licence");
    if (!options.out.empty()) {
        if (const auto written = write_file(options.out, report_to_html(*report)); !written)
            return report_error(written.error());
    }
    if (options.json) return print_json(report_to_json(*report));
    return options.out == "-" ? 0 : print_text(fmt::format("written to {}\n", options.out));
}

}  // namespace thermbal
