#pragma once

#include <vector>

#include "channel_sweep.hpp"
#include "declaration/live_flow.hpp"

namespace thermbal {

/// The stretch of the window in which the machine's inputs did not change, up to its end.
struct Regime {
    double since_s = 0.0;
    std::string began_with;      ///< what changed there; empty at the start of the test
    double last_change_s = 0.0;  ///< of the inputs, also one that the estimate can carry across
    TestWindow window;
    std::vector<double>
        start_level_C;  ///< of the channels at the start of the test; empty when it is this regime's
};
Regime current_regime(const TestWindow& window, const FlowOptions& options);

/// What the guards of one channel look at. References outlive the call.
struct GuardEvidence {
    const TestWindow& window;
    const Column& samples;
    const Regime& regime;
    const SpectrumEstimate* now;                   ///< nullptr when there is none yet
    std::vector<const SpectrumEstimate*> shorter;  ///< of windows one and two look-backs shorter
};

ChannelVerdict begin_verdict(const Column& column, double window_end_min);

// Each asks its predicates, in the order in which a person would, and appends them to verdict.guards.
void ask_samples(ChannelVerdict& verdict, const GuardEvidence& evidence, const FlowOptions& options);
void ask_shared_modes(ChannelVerdict& verdict, const GuardEvidence& evidence, const FlowOptions& options);
void ask_sweep(ChannelVerdict& verdict, const Result<ChannelSweep>& swept, const FlowOptions& options);

/// The shared modes' figures become the verdict's.
void take_estimate(ChannelVerdict& verdict, const GuardEvidence& evidence, const FlowOptions& options);

/// State and reason from the guards.
void conclude(ChannelVerdict& verdict, double window_end_min, const FlowOptions& options);

}  // namespace thermbal
