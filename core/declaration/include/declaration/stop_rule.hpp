#pragma once

#include <span>
#include <string>
#include <vector>

#include "declaration/verdict.hpp"

namespace thermbal {

struct StopDecision {
    bool stop = false;
    bool held = false;                 ///< by sensors that do not measure alone: a person decides
    std::string reason;                ///< what holds, or what is waited for
    std::vector<std::string> waiting;  ///< required channels that are still measured
};

struct StopOptions {
    /// How long the last declaration has to have stood: windows that could contradict it.
    double stands_min = 8.0;
};

/// The test may end when every required channel is declared or barely warming, and the declarations have
/// stood for a while. A required channel that is stuck or dead holds the test: its steady state is not known,
/// and a person has to say what to do (mend it, or stop by hand). `now_min`: the end of the newest window.
/// REQUIRES: required[i] belongs to verdicts[i].
StopDecision decide_stop(std::span<const ChannelVerdict> verdicts, const std::vector<bool>& required,
                         double now_min, const StopOptions& options = {});

}  // namespace thermbal
