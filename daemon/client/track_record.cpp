#include "track_record.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <ranges>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "columns.hpp"
#include "declaration/compare.hpp"
#include "fields.hpp"
#include "output.hpp"
#include "report/verdict_json.hpp"
#include "statistics.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

constexpr double went_on_min = 30.0;  // least time between a declaration and the end it is held against
constexpr double room_moved_C = 1.0;  // a correction for more is a model and not a measurement
constexpr double wrong_C = 0.3;
constexpr double wrong_share_of_rise = 0.05;

/// A finished test, and where its channels settled.
struct FinishedTest {
    StoredTest stored;
    std::string ambient;
    TestWindow window;
    std::vector<std::string> channels;
    RecordingEnd end;

    double room_C(double at_min) const {
        return mean_before_C(window, ambient, at_min * 60.0, MeasuredEndOptions{}.mean_min);
    }
    double minute_of(std::int64_t scan) const {
        return static_cast<double>(scan) * stored.record.period_s / 60.0;
    }
};

Result<FinishedTest> finished_test(const Reader& reader, const StoredTest& stored) {
    auto window = reader.window(stored.id);
    if (!window) return std::unexpected(window.error());
    std::string ambient;
    std::vector<std::string> channels;
    for (const ChannelRecord& channel : stored.record.channels) {
        if (channel.role == "ambient" && ambient.empty()) ambient = channel.name;
        if (channel.role != "ambient") channels.push_back(channel.name);
    }
    FlowOptions options;
    options.ambient = ambient;
    RecordingEnd end = end_of_recording(*window, channels, options);
    return FinishedTest{stored, ambient, std::move(*window), std::move(channels), std::move(end)};
}

const Result<MeasuredEnd>* end_of(const FinishedTest& test, const std::string& channel) {
    const auto found = std::ranges::find(test.channels, channel);
    return found == test.channels.end()
               ? nullptr
               : &test.end.channels[static_cast<std::size_t>(found - test.channels.begin())];
}

/// Why the end of the test says nothing about a declaration made at `at_min`; empty when it does.
std::string why_not(const FinishedTest& test, const Result<MeasuredEnd>& end, double at_min) {
    const double end_min = test.window.end_s() / 60.0;
    if (at_min < test.end.regime_since_min)
        return fmt::format("the machine's inputs changed at {:.0f} min", test.end.regime_since_min);
    if (end_min - at_min < went_on_min)
        return fmt::format("the test ended {:.0f} min later (needed {:.0f} min)", end_min - at_min,
                           went_on_min);
    if (!end) return end.error().message;
    if (!end->settled) return "it has not settled: " + end->figures;
    const double moved_C = std::abs(end->room_C - test.room_C(at_min));
    if (moved_C > room_moved_C)
        return fmt::format("the room moved by {:.1f} C since (allowed {:.1f} C)", moved_C, room_moved_C);
    return {};
}

/// The windows that a channel was identified on up to its declaration, newest first, as long as they were
/// right.
double earliest_honest_min(const FinishedTest& test, const MeasuredEnd& end,
                           const std::vector<IdentificationRecord>& identifications,
                           std::int64_t declared_scan, double tolerance_C) {
    double earliest_min = no_value;
    for (const IdentificationRecord& record : std::views::reverse(identifications)) {
        if (record.window_end_scan > declared_scan) continue;
        const auto verdict = verdict_from_json(json::parse(record.verdict_json, nullptr, false));
        if (!verdict) break;
        const double at_min = test.minute_of(record.window_end_scan);
        const double settles_C = end.settles_at_C(test.room_C(at_min));
        const bool right = std::abs(verdict->steady_state_C - settles_C) <= tolerance_C &&
                           verdict->steady_state_low_C <= settles_C &&
                           settles_C <= verdict->steady_state_high_C;
        if (!right) break;
        earliest_min = at_min;
    }
    return earliest_min;
}

TrackedDeclaration track(const FinishedTest& test, const DeclarationRecord& declaration,
                         const std::vector<IdentificationRecord>& identifications, double tolerance_C) {
    TrackedDeclaration tracked;
    tracked.test = test.stored.id;
    tracked.machine = test.stored.record.machine;
    tracked.declared = declaration;
    const Result<MeasuredEnd>* const end = end_of(test, declaration.channel);
    if (end == nullptr) {
        tracked.does_not_count = "its channel is not in the test";
        return tracked;
    }
    const double at_min = test.minute_of(declaration.window_end_scan);
    tracked.does_not_count = why_not(test, *end, at_min);
    if (!tracked.does_not_count.empty()) return tracked;
    tracked.settles_at_C = (*end)->settles_at_C(test.room_C(at_min));
    tracked.error_C = declaration.steady_state_C - tracked.settles_at_C;
    tracked.rise_C = tracked.settles_at_C - (*end)->start_C;
    tracked.held = declaration.steady_state_low_C <= tracked.settles_at_C &&
                   tracked.settles_at_C <= declaration.steady_state_high_C;
    tracked.wrong =
        !(std::abs(tracked.error_C) <= std::max(wrong_C, wrong_share_of_rise * std::abs(tracked.rise_C)));
    tracked.earliest_honest_min =
        earliest_honest_min(test, **end, identifications, declaration.window_end_scan, tolerance_C);
    return tracked;
}

Result<std::vector<TrackedDeclaration>> track_test(const Reader& reader, const StoredTest& stored,
                                                   double tolerance_C) {
    std::vector<TrackedDeclaration> tracked;
    const auto declarations = reader.declarations(stored.id);
    if (!declarations) return std::unexpected(declarations.error());
    if (declarations->empty()) return tracked;
    const auto test = finished_test(reader, stored);
    if (!test) return std::unexpected(test.error());
    for (const DeclarationRecord& declaration : *declarations) {
        const auto identifications = reader.identifications(stored.id, declaration.channel);
        if (!identifications) return std::unexpected(identifications.error());
        tracked.push_back(track(*test, declaration, *identifications, tolerance_C));
    }
    return tracked;
}

json tracked_json(const TrackedDeclaration& tracked) {
    const DeclarationRecord& declared = tracked.declared;
    json row = {{"test", tracked.test},
                {"machine", tracked.machine},
                {"channel", declared.channel},
                {"declared_at_min", number_or_null(declared.declared_at_min)},
                {"steady_state_C", number_or_null(declared.steady_state_C)},
                {"steady_state_low_C", number_or_null(declared.steady_state_low_C)},
                {"steady_state_high_C", number_or_null(declared.steady_state_high_C)},
                {"withdrawn", declared.withdrawn},
                {"counts", tracked.does_not_count.empty()},
                {"does_not_count", tracked.does_not_count},
                {"settles_at_C", number_or_null(tracked.settles_at_C)},
                {"error_C", number_or_null(tracked.error_C)},
                {"rise_C", number_or_null(tracked.rise_C)},
                {"held", nullptr},
                {"wrong", nullptr},
                {"earliest_honest_min", number_or_null(tracked.earliest_honest_min)}};
    if (tracked.does_not_count.empty()) {
        row["held"] = tracked.held;
        row["wrong"] = tracked.wrong;
    }
    return row;
}

json summary_of(const std::vector<TrackedDeclaration>& all) {
    std::vector<double> errors_C, declared_min, honest_min;
    std::size_t held = 0, wrong = 0;
    for (const TrackedDeclaration& tracked : all) {
        if (!tracked.does_not_count.empty()) continue;
        errors_C.push_back(tracked.error_C);
        declared_min.push_back(tracked.declared.declared_at_min);
        if (std::isfinite(tracked.earliest_honest_min)) honest_min.push_back(tracked.earliest_honest_min);
        held += tracked.held ? 1 : 0;
        wrong += tracked.wrong ? 1 : 0;
    }
    const auto [held_low, held_high] = wilson_interval(held, errors_C.size());
    return {{"declarations", all.size()},
            {"counted", errors_C.size()},
            {"wrong", wrong},
            {"bias_C", number_or_null(mean(errors_C))},
            {"rms_error_C", number_or_null(root_mean_square(errors_C))},
            {"held", held},
            {"held_share", number_or_null(errors_C.empty() ? no_value
                                                           : static_cast<double>(held) /
                                                                 static_cast<double>(errors_C.size()))},
            {"held_share_low", number_or_null(held_low)},
            {"held_share_high", number_or_null(held_high)},
            {"median_declared_at_min", number_or_null(median(declared_min))},
            {"median_earliest_honest_min", number_or_null(median(honest_min))}};
}

std::string document_text(const json& document) {
    TextTable table({{"test", true},
                     {"machine"},
                     {"channel"},
                     {"declared", true},
                     {"at", true},
                     {"90 % interval"},
                     {"settled at", true},
                     {"error", true},
                     {"held"},
                     {"honest from", true},
                     {"remark"}});
    for (const json& row : document["declarations"]) {
        const auto yes_no = [&](const char* key) {
            return row[key].is_boolean() ? (row[key].get<bool>() ? "yes" : "no") : "-";
        };
        std::string remark = text(row, "does_not_count");
        if (!remark.empty()) remark.insert(0, "does not count: ");
        if (row["wrong"] == true) remark = "wrong";
        if (const std::string why = text(row, "withdrawn"); !why.empty())
            remark.append(remark.empty() ? "withdrawn: " : "; withdrawn: ").append(why);
        table.add({std::to_string(row["test"].get<TestId>()), text(row, "machine"), text(row, "channel"),
                   fixed(number(row, "steady_state_C"), 2), minutes(number(row, "declared_at_min")),
                   fixed(number(row, "steady_state_low_C"), 2) + " .. " +
                       fixed(number(row, "steady_state_high_C"), 2),
                   fixed(number(row, "settles_at_C"), 2), with_sign(number(row, "error_C"), 2),
                   yes_no("held"), minutes(number(row, "earliest_honest_min")), remark});
    }
    const json& sum = document["summary"];
    return table.str() +
           fmt::format(
               "{} declarations, {} count; {} off by more than max({:.1f} C, {:.0f} % of the rise)\n"
               "bias {} C, RMS error {} C, 90 % intervals held {} of {} ({} .. {} at 95 %)\n"
               "declared at {} (median), could honestly have been from {}\n",
               sum["declarations"].get<std::size_t>(), sum["counted"].get<std::size_t>(),
               sum["wrong"].get<std::size_t>(), wrong_C, 100.0 * wrong_share_of_rise,
               with_sign(number(sum, "bias_C"), 3), fixed(number(sum, "rms_error_C"), 3),
               sum["held"].get<std::size_t>(), sum["counted"].get<std::size_t>(),
               fixed(number(sum, "held_share_low"), 2), fixed(number(sum, "held_share_high"), 2),
               minutes(number(sum, "median_declared_at_min")),
               minutes(number(sum, "median_earliest_honest_min")));
}

}  // namespace

Result<std::vector<TrackedDeclaration>> track_declarations(const Reader& reader, double tolerance_C) {
    auto tests = reader.tests();
    if (!tests) return std::unexpected(tests.error());
    std::ranges::reverse(*tests);
    std::vector<TrackedDeclaration> all;
    for (const StoredTest& stored : *tests) {
        if (!stored.record.keep_measuring || stored.open()) continue;
        auto tracked = track_test(reader, stored, tolerance_C);
        if (!tracked) return tracked;
        std::ranges::move(*tracked, std::back_inserter(all));
    }
    return all;
}

int run_track_record(const TrackRecordOptions& options) {
    const auto reader = open_database(options.database);
    if (!reader) return report_error(reader.error());
    const auto tracked = track_declarations(*reader, options.tolerance_C);
    if (!tracked) return report_error(tracked.error());
    json rows = json::array();
    for (const TrackedDeclaration& declaration : *tracked) rows.push_back(tracked_json(declaration));
    const json document{{"declarations", std::move(rows)}, {"summary", summary_of(*tracked)}};
    if (options.database.ask.json) return print_json(document);
    if (tracked->empty())
        return print_text(
            "no declaration of an ended test with keep_measuring: nothing to hold against what happened\n");
    return print_text(document_text(document));
}

}  // namespace thermbal
