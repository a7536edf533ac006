#pragma once

#include <functional>
#include <string>
#include <vector>

#include "declaration/declarations.hpp"
#include "declaration/stop_rule.hpp"
#include "offline_input.hpp"
#include "progress.hpp"
#include "series/sample.hpp"

namespace thermbal {

/// A command runs to its end; ctrl-C ends the program.
inline bool not_cancelled() {
    return false;
}

struct ReplayChange {
    double at_min = 0.0;
    DeclarationChange change;
};

/// What the daemon would have made of a recording.
struct Replay {
    std::vector<ChannelVerdict> channels;  ///< at the stop, or at the recording's end
    std::vector<ReplayChange> changes;
    double stopped_at_min = no_value;  ///< NaN: not stopped
    StopDecision decision;
    std::string archive_dropped;  ///< why earlier tests were not used; empty when they were, or none
};

/// The growing window: identification again every options.every_min, until the stop rule holds or the
/// recording ends. `tell` hears every change as it is made, `progress` how far it is. Errors (refuse_input):
/// the recording cannot be identified at all.
Result<Replay> replay(const OfflineInput& input, const OfflineOptions& options,
                      const std::function<void(const ReplayChange&)>& tell, Progress& progress);

}  // namespace thermbal
