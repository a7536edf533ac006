#include "replay.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>

#include "compute/threads.hpp"

namespace thermbal {
namespace {

/// Of the channels that were not declared a person wants to see the curve too.
void sweep_the_others(Replay& done, const OfflineInput& input, const Declarations& declarations,
                      const ParallelFor& parallel_for) {
    FlowOptions everything = input.flow;
    everything.sweep_when = SweepWhen::always;
    const auto verdict =
        LiveFlow(everything)
            .identify(input.window, declarations.declared_channels(), parallel_for, not_cancelled);
    if (!verdict) return;
    for (ChannelVerdict& channel : done.channels) {
        if (channel.declared()) continue;
        const auto whole = std::ranges::find(verdict->channels, channel.channel, &ChannelVerdict::channel);
        if (whole != verdict->channels.end() && !whole->declared()) channel = *whole;
    }
}

}  // namespace

Result<Replay> replay(const OfflineInput& input, const OfflineOptions& options,
                      const std::function<void(const ReplayChange&)>& tell, Progress& progress) {
    const ParallelFor parallel_for = parallel_on_threads(options.threads, false);
    LiveFlow flow(input.flow);
    Declarations declarations;
    Replay done;
    const double end_min = input.window.end_s() / 60.0;
    const double first_min = input.window.start_s / 60.0;
    double until_min = first_min;
    for (bool more = true; more;) {
        // The last scan ends a window, however long the steps are.
        until_min += options.every_min;
        more = until_min < end_min - 1e-9;
        until_min = std::min(until_min, end_min);
        // The work of a window grows with its length, so all windows up to here go with its square.
        progress.set(std::pow((until_min - first_min) / (end_min - first_min), 2.0));
        const TestWindow window = window_until(input.window, until_min * 60.0);
        const auto verdict =
            flow.identify(window, declarations.declared_channels(), parallel_for, not_cancelled);
        if (!verdict && verdict.error().next == NextStep::refuse_input)
            return std::unexpected(verdict.error());
        if (!verdict) continue;
        if (done.archive_dropped.empty() && !verdict->archive_dropped.empty()) {
            done.archive_dropped = verdict->archive_dropped;
            fmt::print(stderr, "thermbalctl: at {:.2f} min: {}\n", verdict->window_end_min,
                       done.archive_dropped);
        }
        for (DeclarationChange& change : declarations.update(verdict->channels, verdict->last_change_min)) {
            done.changes.push_back({verdict->window_end_min, std::move(change)});
            tell(done.changes.back());
        }
        done.decision =
            decide_stop(declarations.standing(), std::vector<bool>(declarations.standing().size(), true),
                        verdict->window_end_min);
        if (done.decision.stop) {
            done.stopped_at_min = verdict->window_end_min;
            break;
        }
    }
    done.channels = declarations.standing();
    if (!done.decision.stop && !options.modes_only) sweep_the_others(done, input, declarations, parallel_for);
    return done;
}

}  // namespace thermbal
