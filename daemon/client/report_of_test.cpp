#include <algorithm>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "compute/flow_options.hpp"
#include "compute/threads.hpp"
#include "config/load.hpp"
#include "report/verdict_json.hpp"
#include "report_command.hpp"
#include "report_courses.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

constexpr std::int64_t most_events = 400;

std::optional<ChannelVerdict> verdict_in(const std::string& stored) {
    auto verdict = verdict_from_json(json::parse(stored, nullptr, false));
    return verdict ? std::optional(std::move(*verdict)) : std::nullopt;
}

/// The standing declaration of each channel, else its newest verdict.
Result<void> add_verdicts(TestReport& report, const Reader& reader, TestId id) {
    const auto identified = reader.latest_identifications(id);
    if (!identified) return std::unexpected(identified.error());
    const auto declared = reader.declarations(id);
    if (!declared) return std::unexpected(declared.error());
    for (ReportChannel& channel : report.channels) {
        const auto newest = std::ranges::find(*identified, channel.name, &IdentificationRecord::channel);
        if (newest != identified->end()) channel.verdict = verdict_in(newest->verdict_json);
        for (const DeclarationRecord& declaration : *declared) {
            if (declaration.channel != channel.name) continue;
            channel.withdrawn = declaration.withdrawn;
            if (declaration.withdrawn.empty()) channel.verdict = verdict_in(declaration.basis_json);
        }
    }
    return {};
}

Result<void> add_scans(TestReport& report, const Reader& reader, TestId id) {
    const auto scans = reader.scans(id);
    if (!scans) return std::unexpected(scans.error());
    std::map<ScanStatus, std::size_t> counts;
    for (ReportChannel& channel : report.channels) channel.quality.assign(report.window.scans, Quality::gap);
    for (const ScanRecord& scan : *scans) {
        ++counts[scan.status];
        const auto at = static_cast<std::size_t>(scan.scan);
        for (std::size_t c = 0; c < std::min(scan.samples.size(), report.channels.size()); ++c) {
            if (at < report.window.scans) report.channels[c].quality[at] = scan.samples[c].quality;
        }
    }
    for (const auto& [status, count] : counts) report.scans.emplace_back(to_string(status), count);
    return {};
}

Result<void> add_events(TestReport& report, const Reader& reader, TestId id) {
    const auto events = reader.events(id, 0, most_events + 1);
    if (!events) return std::unexpected(events.error());
    report.has_older_events = static_cast<std::int64_t>(events->size()) > most_events;
    for (std::size_t i = report.has_older_events ? 1 : 0; i < events->size(); ++i) {
        const EventRecord& event = (*events)[i];
        const auto time_min = event.time_s ? std::optional(*event.time_s / 60.0) : std::nullopt;
        report.events.push_back({time_min, event.kind, event.channel.value_or(""), event.message});
    }
    return {};
}

void add_channels(TestReport& report, const std::vector<ChannelRecord>& records) {
    for (const ChannelRecord& record : records) {
        report.channels.push_back({.name = record.name,
                                   .place = record.place,
                                   .is_ambient = record.role == "ambient",
                                   .required = record.required,
                                   .source = record.source,
                                   .calibration = record.calibration});
    }
}

}  // namespace

Result<TestReport> report_of_test(const Reader& reader, TestId id, const ReportOptions& options) {
    const auto stored = reader.test(id);
    if (!stored) return std::unexpected(stored.error());
    const TestRecord& record = stored->record;
    FlowOptions flow = flow_options(stored_identification(record.config_toml));
    TestReport report{.name = record.name,
                      .machine = record.machine,
                      .source = fmt::format("test {}", id),
                      .started = local_time(record.started.wall_ns),
                      .state = std::string(to_string(stored->state)),
                      .end_reason = stored->stop_reason,
                      .tolerance_C = flow.tolerance_C,
                      .tolerance_share_of_rise = flow.tolerance_share_of_rise};
    auto window = reader.window(id);
    if (!window) return std::unexpected(window.error());
    report.window = std::move(*window);
    report.configuration = record.config_toml;
    report.versions.emplace_back("measured and declared by", "thermbald " + record.version);
    add_channels(report, record.channels);
    for (const auto& add : {add_verdicts, add_scans, add_events}) {
        if (auto added = add(report, reader, id); !added) return std::unexpected(added.error());
    }
    const auto room = std::ranges::find(report.channels, true, &ReportChannel::is_ambient);
    flow.ambient = room == report.channels.end() ? "" : room->name;
    add_courses(report, flow, parallel_on_threads(options.recording.threads, false));
    return report;
}

}  // namespace thermbal
