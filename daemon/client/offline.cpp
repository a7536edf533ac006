#include "offline.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "compute/threads.hpp"
#include "declaration/declarations.hpp"
#include "declaration/stop_rule.hpp"
#include "offline_input.hpp"
#include "output.hpp"
#include "report/spectrum_json.hpp"
#include "report/verdict_json.hpp"
#include "series/sample.hpp"
#include "store/store.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

bool not_cancelled() {
    return false;
}

json channels_json(const OfflineOptions& options, const std::vector<ChannelVerdict>& verdicts) {
    json list = json::array();
    for (const ChannelVerdict& verdict : verdicts) {
        if (is_wanted(options, verdict.channel)) list.push_back(verdict_to_json(verdict));
    }
    return list;
}

void print_table(const OfflineOptions& options, const std::vector<ChannelVerdict>& verdicts) {
    fmt::print("{:<6} {:<14} {:>9} {:>4} {:>8} {:>9} {:>17} {:>9}  {}\n", "", "state", "declared", "n",
               "RMSE", "settles", "90 % interval", "95 % at", "reason");
    const auto number = [](double value, const char* unit, int digits) {
        return std::isfinite(value) ? fmt::format("{:.{}f} {}", value, digits, unit) : std::string("-");
    };
    for (const ChannelVerdict& v : verdicts) {
        if (!is_wanted(options, v.channel)) continue;
        const std::string interval =
            std::isfinite(v.steady_state_low_C)
                ? fmt::format("{:.2f} .. {:.2f} C", v.steady_state_low_C, v.steady_state_high_C)
                : "-";
        fmt::print("{:<6} {:<14} {:>9} {:>4} {:>8} {:>9} {:>17} {:>9}  {}\n", v.channel, to_string(v.state),
                   number(v.declared_at_min, "min", 1), v.n > 0 ? std::to_string(v.n) : "-",
                   number(v.window_rmse_C, "C", 3), number(v.steady_state_C, "C", 2), interval,
                   number(v.equilibrium_time_min, "min", 0), v.reason);
    }
}

}  // namespace

int run_identify(const OfflineOptions& options) {
    auto input = read_input(options);
    if (!input) return report_error(input.error());
    if (options.until_min) input->window = window_until(input->window, *options.until_min * 60.0);
    if (!options.modes_only) input->flow.sweep_when = SweepWhen::always;
    std::set<std::string>
        unwanted;  // the others are estimated, the shared time constants need them, but not swept
    for (const Column& column : input->window.channels) {
        if (!is_wanted(options, column.name)) unwanted.insert(column.name);
    }
    LiveFlow flow(input->flow);
    const auto verdict =
        flow.identify(input->window, unwanted, parallel_on_threads(options.threads, false), not_cancelled);
    if (!verdict) return report_error(verdict.error());
    if (options.json) {
        fmt::print("{}\n", json{{"window_end_min", verdict->window_end_min},
                                {"regime_since_min", verdict->regime_since_min},
                                {"channels", channels_json(options, verdict->channels)}}
                               .dump(2));
    } else {
        fmt::print("window: {:.2f} to {:.2f} min\n", verdict->regime_since_min, verdict->window_end_min);
        print_table(options, verdict->channels);
    }
    return 0;
}

int run_learn(const LearnOptions& options) {
    OfflineOptions one;
    one.ambient = options.ambient;
    auto store = Store::open(options.archive, {options.now_wall_ns, 0});
    if (!store) return report_error(store.error());
    for (const std::string& file : options.files) {
        one.file = file;
        const auto input = read_input(one);
        if (!input) return report_error(input.error());
        FlowOptions flow = input->flow;
        flow.sweep_when = SweepWhen::never;
        const auto verdict =
            LiveFlow(flow).identify(input->window, {}, parallel_on_threads(1, false), not_cancelled);
        if (!verdict) return report_error(verdict.error());
        if (!verdict->spectrum) {
            return report_error(
                {NextStep::refuse_input,
                 fmt::format("{}: the machine's inputs change during the test; expected one regime", file)});
        }
        const auto id = store->record_archive({.id = 0,
                                               .machine = options.machine,
                                               .test_id = {},
                                               .created_wall_ns = options.now_wall_ns,
                                               .spectrum_json = spectrum_to_json(*verdict->spectrum).dump()});
        if (!id) return report_error(id.error());
        fmt::print("{}: {:.0f} min of {} are in {}\n", file, verdict->window_end_min,
                   options.machine.empty() ? "a machine without name" : options.machine, options.archive);
    }
    return 0;
}

int run_replay(const OfflineOptions& options) {
    const auto input = read_input(options);
    if (!input) return report_error(input.error());
    const ParallelFor parallel_for = parallel_on_threads(options.threads, false);
    LiveFlow flow(input->flow);
    Declarations declarations;
    json changes = json::array();
    std::string archive_dropped;
    double stopped_at_min = no_value;
    StopDecision decision;
    const double end_min = input->window.end_s() / 60.0;
    const double first_min = input->window.start_s / 60.0;
    for (double until_min = first_min + options.every_min; until_min <= end_min + 1e-9;
         until_min += options.every_min) {
        const TestWindow window = window_until(input->window, until_min * 60.0);
        const auto verdict =
            flow.identify(window, declarations.declared_channels(), parallel_for, not_cancelled);
        if (!verdict && verdict.error().next == NextStep::refuse_input) return report_error(verdict.error());
        if (!verdict) continue;
        if (archive_dropped.empty() && !verdict->archive_dropped.empty()) {
            archive_dropped = verdict->archive_dropped;
            fmt::print(stderr, "thermbalctl: at {:.2f} min: {}\n", verdict->window_end_min, archive_dropped);
        }
        for (const DeclarationChange& change :
             declarations.update(verdict->channels, verdict->regime_since_min)) {
            const bool declared = change.kind == DeclarationChange::Kind::declared;
            changes.push_back({{"at_min", verdict->window_end_min},
                               {"channel", change.channel},
                               {"change", declared ? "declared" : "withdrawn"},
                               {"reason", change.reason}});
            if (!options.json) {
                fmt::print("{:7.2f} min  {} {}: {}\n", verdict->window_end_min, change.channel,
                           declared ? "declared" : "withdrawn", change.reason);
            }
        }
        decision =
            decide_stop(declarations.standing(), std::vector<bool>(declarations.standing().size(), true));
        if (decision.stop) {
            stopped_at_min = verdict->window_end_min;
            break;
        }
    }
    // Of the channels that were not declared a person wants to see the curve too.
    std::vector<ChannelVerdict> last = declarations.standing();
    if (!decision.stop && !options.modes_only) {
        FlowOptions everything = input->flow;
        everything.sweep_when = SweepWhen::always;
        const auto verdict =
            LiveFlow(everything)
                .identify(input->window, declarations.declared_channels(), parallel_for, not_cancelled);
        for (ChannelVerdict& channel : last) {
            if (channel.declared() || !verdict) continue;
            const auto whole =
                std::ranges::find(verdict->channels, channel.channel, &ChannelVerdict::channel);
            if (whole != verdict->channels.end() && !whole->declared()) channel = *whole;
        }
    }
    if (options.json) {
        fmt::print("{}\n", json{{"test_stopped_at_min", number_or_null(stopped_at_min)},
                                {"reason", decision.reason},
                                {"archive_dropped", archive_dropped},
                                {"changes", std::move(changes)},
                                {"channels", channels_json(options, last)}}
                               .dump(2));
    } else {
        print_table(options, last);
        fmt::print("{}\n", std::isfinite(stopped_at_min)
                               ? fmt::format("test stopped at {:.2f} of {:.2f} min: {}", stopped_at_min,
                                             end_min, decision.reason)
                               : fmt::format("test not stopped in {:.2f} min: {}", end_min, decision.reason));
    }
    return 0;
}

}  // namespace thermbal
