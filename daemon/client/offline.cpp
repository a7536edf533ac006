#include "offline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "compute/threads.hpp"
#include "manual/standard_streams.hpp"
#include "offline_input.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "replay.hpp"
#include "report/spectrum_json.hpp"
#include "report/verdict_json.hpp"
#include "series/sample.hpp"
#include "store/store.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

json channels_json(const OfflineOptions& options, const std::vector<ChannelVerdict>& verdicts) {
    json list = json::array();
    for (const ChannelVerdict& verdict : verdicts) {
        if (is_wanted(options, verdict.channel)) list.push_back(verdict_to_json(verdict));
    }
    return list;
}

std::string table_text(const OfflineOptions& options, const std::vector<ChannelVerdict>& verdicts) {
    std::string text = fmt::format("{:<6} {:<14} {:>9} {:>4} {:>8} {:>9} {:>17} {:>9}  {}\n", "", "state",
                                   "declared", "n", "RMSE", "settles", "90 % interval", "95 % at", "reason");
    const auto number = [](double value, const char* unit, int digits) {
        return std::isfinite(value) ? fmt::format("{:.{}f} {}", value, digits, unit) : std::string("-");
    };
    for (const ChannelVerdict& v : verdicts) {
        if (!is_wanted(options, v.channel)) continue;
        const std::string interval =
            std::isfinite(v.steady_state_low_C)
                ? fmt::format("{:.2f} .. {:.2f} C", v.steady_state_low_C, v.steady_state_high_C)
                : "-";
        text += fmt::format("{:<6} {:<14} {:>9} {:>4} {:>8} {:>9} {:>17} {:>9}  {}\n", v.channel,
                            to_string(v.state), number(v.declared_at_min, "min", 1),
                            v.n > 0 ? std::to_string(v.n) : "-", number(v.window_rmse_C, "C", 3),
                            number(v.steady_state_C, "C", 2), interval,
                            number(v.equilibrium_time_min, "min", 0), v.reason);
    }
    return text;
}

/// What a recording leaves for the archive.
struct Lesson {
    std::string file;
    ArchivedSpectrum spectrum;
    double length_min = 0.0;
};

/// Which of these guards a channel does not pass, with the channel's name; nothing where all do, or its
/// sensor is broken.
std::optional<std::string> first_failing(const std::vector<ChannelVerdict>& channels,
                                         std::span<const std::string_view> asked) {
    for (const ChannelVerdict& channel : channels) {
        for (const Guard& guard : channel.guards) {
            if (!guard.passed && std::ranges::find(asked, guard.name) != asked.end())
                return fmt::format("{} is not known yet ({})", channel.channel, guard.figures);
        }
    }
    return std::nullopt;
}

/// A recording teaches what it knows at its end: an unsettled one would teach a guess, and later tests would
/// be declared on it. It knows its end where each channel passes what a declaration asks of the end; or where
/// it went on until nothing slow was left to come: an interval that is still wide is the room's doing then.
/// Of the newest samples and the room nothing is asked: they matter to a declaration, not to a lesson.
Result<Lesson> lesson_of(const std::string& file, const OfflineInput& input) {
    constexpr std::array<std::string_view, 3> of_the_end{"interval_within_tolerance",
                                                         "slowest_seen_long_enough", "most_of_the_rise_seen"};
    const auto identified = [&](const FlowOptions& flow) {
        return LiveFlow(flow).identify(input.window, {}, parallel_on_threads(1, false), not_cancelled);
    };
    auto verdict = identified(input.flow);
    if (!verdict) return std::unexpected(verdict.error());
    if (!verdict->spectrum) {
        return fail(
            NextStep::refuse_input,
            fmt::format("{}: the machine's inputs change during the test, or it is too short; expected "
                        "one regime, measured until it has settled",
                        file));
    }
    if (const auto unknown = first_failing(verdict->channels, of_the_end)) {
        FlowOptions measured_out = input.flow;
        measured_out.guards.slow_time_constants = 2.0;
        measured_out.guards.share_of_rise = 0.8;
        const auto again = identified(measured_out);
        if (!again) return std::unexpected(again.error());
        if (first_failing(again->channels, std::span(of_the_end).subspan(1))) {
            return fail(NextStep::refuse_input,
                        fmt::format("{}: ends at {:.0f} min, where {}; only a recording that has settled "
                                    "teaches. Measure on; thermbalctl identify says how far each channel is",
                                    file, verdict->window_end_min, *unknown));
        }
    }
    return Lesson{file, std::move(*verdict->spectrum), verdict->window_end_min};
}

}  // namespace

int run_identify(const OfflineOptions& options) {
    auto input = read_input(options);
    if (!input) return report_error(input.error());
    if (options.until_min) {
        const double first_min = input->window.start_s / 60.0;
        if (*options.until_min < first_min) {
            return report_error(
                {NextStep::refuse_input, fmt::format("--until-min {}: {} begins at {:.2f} min",
                                                     *options.until_min, options.file, first_min)});
        }
        input->window = window_until(input->window, *options.until_min * 60.0);
    }
    if (!options.modes_only) input->flow.sweep_when = SweepWhen::always;
    std::set<std::string>
        unwanted;  // the others are estimated, the shared time constants need them, but not swept
    for (const Column& column : input->window.channels) {
        if (!is_wanted(options, column.name)) unwanted.insert(column.name);
    }
    LiveFlow flow(input->flow);
    std::optional<Progress> progress("identify");
    const auto verdict =
        flow.identify(input->window, unwanted,
                      progress->counting(parallel_on_threads(options.threads, false)), not_cancelled);
    progress.reset();
    if (!verdict) return report_error(verdict.error());
    if (options.json) {
        return print_json({{"window_end_min", verdict->window_end_min},
                           {"regime_since_min", verdict->regime_since_min},
                           {"channels", channels_json(options, verdict->channels)}});
    }
    return print_text(
        fmt::format("window: {:.2f} to {:.2f} min\n", verdict->regime_since_min, verdict->window_end_min) +
        table_text(options, verdict->channels));
}

int run_learn(const LearnOptions& options) {
    std::vector<OfflineInput> inputs;
    for (const std::string& file : options.files) {
        OfflineOptions of_file;
        of_file.file = file;
        of_file.ambient = options.ambient;
        of_file.modes_only = true;
        auto input = read_input(of_file);
        if (!input) return report_error(input.error());
        inputs.push_back(std::move(*input));
    }
    std::vector<Lesson> lessons;
    std::vector<Error> refused;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        auto lesson = lesson_of(options.files[i], inputs[i]);
        if (lesson) {
            lessons.push_back(std::move(*lesson));
        } else {
            refused.push_back(lesson.error());
        }
    }
    if (lessons.empty()) return report_error(refused.front());
    auto store = Store::open(options.archive, {options.now_wall_ns, 0});
    if (!store) return report_error(store.error());
    std::string text;
    for (const Lesson& lesson : lessons) {
        const auto id = store->record_archive({.id = 0,
                                               .machine = options.machine,
                                               .test_id = {},
                                               .created_wall_ns = options.now_wall_ns,
                                               .spectrum_json = spectrum_to_json(lesson.spectrum).dump()});
        if (!id) return report_error(id.error());
        text += fmt::format("{}: {:.0f} min of {} are in {}\n", lesson.file, lesson.length_min,
                            options.machine.empty() ? "a machine without name" : options.machine,
                            options.archive);
    }
    // The archive has what it could get; what it did not get is said all the same.
    for (const Error& error : refused) std::ignore = report_error(error);
    return print_text(text);
}

int run_replay(const OfflineOptions& options) {
    const auto input = read_input(options);
    if (!input) return report_error(input.error());
    std::optional<Progress> progress("replay");
    const auto tell = [&](const ReplayChange& one) {
        if (options.json) return;
        // Said as it happens; whether it was taken is asked at the end.
        std::ignore = print_out(fmt::format("{:7.2f} min  {} {}: {}\n", one.at_min, one.change.channel,
                                            to_string(one.change.kind), one.change.reason));
    };
    const auto done = replay(*input, options, tell, *progress);
    progress.reset();
    if (!done) return report_error(done.error());
    if (options.json) {
        json changes = json::array();
        for (const ReplayChange& one : done->changes) {
            changes.push_back({{"at_min", one.at_min},
                               {"channel", one.change.channel},
                               {"change", to_string(one.change.kind)},
                               {"reason", one.change.reason}});
        }
        return print_json({{"test_stopped_at_min", number_or_null(done->stopped_at_min)},
                           {"reason", done->decision.reason},
                           {"archive_dropped", done->archive_dropped},
                           {"changes", std::move(changes)},
                           {"channels", channels_json(options, done->channels)}});
    }
    const double end_min = input->window.end_s() / 60.0;
    const std::string ending =
        std::isfinite(done->stopped_at_min)
            ? fmt::format("test stopped at {:.2f} of {:.2f} min: {}\n", done->stopped_at_min, end_min,
                          done->decision.reason)
            : fmt::format("test not stopped in {:.2f} min: {}\n", end_min, done->decision.reason);
    return print_text(table_text(options, done->channels) + ending);
}

}  // namespace thermbal
