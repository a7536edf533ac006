#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "declaration/criterion.hpp"
#include "declaration/verdict.hpp"
#include "filter/denoise.hpp"
#include "filter/gaps.hpp"
#include "filter/outliers.hpp"
#include "modes/archive.hpp"
#include "modes/regime.hpp"
#include "modes/spectrum.hpp"
#include "regression/sweep.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

struct GuardOptions {
    double shortest_window_min = 20.0;  ///< of one regime
    double after_change_min = 15.0;     ///< no declaration sooner after any change of the machine's inputs
    double newest_sample_min = 2.0;     ///< how long ago a channel's newest good sample may be
    double room_step_C = 0.3;           ///< how far the room may be from where it was some minutes ago ...
    double room_step_over_usual = 1.5;  ///< ... or this many times what is usual in this room
    double good_share = 0.8;            ///< of a channel's samples in the window
    double look_back_min = 4.0;        ///< "stable": the window, one this much shorter, and one twice as much
    double drift_in_tolerances = 1.0;  ///< how far the prediction may move over both
    double slow_time_constants = 0.7;  ///< of the slowest supported time constant that must have been seen
    double slow_time_constants_archived = 0.5;  ///< ... where earlier tests have shown the slow share
    double share_of_machines_slowest = 0.7;     ///< of the slowest time constant of all channels, for each
    double share_of_rise = 0.6;    ///< of its way to the steady state that a channel must have gone
    double svr_agreement_C = 0.0;  ///< 0: the SVR's steady state is reported, it has no veto
    double overshoot_C = 0.5;      ///< how far a settling channel may be predicted back below where it is
    double barely_rise_in_tolerances = 1.0;
    double stuck_min = 20.0;    ///< the very same reading for so long or longer ...
    double stuck_rise_C = 1.0;  ///< ... while the median channel moved this much, or against its own noise
};

/// On which channels the SVR sweep, the costly step, is run.
enum class SweepWhen {
    always,
    needed,  ///< only where every guard before it has passed
    never,   ///< a study of the shared modes alone: the criterion is not asked
};

struct FlowOptions {
    std::string ambient = "T1";  ///< the channel that measures the room; empty: none
    /// Half width that the 90 % interval of a declaration may have: so much, or this share of the channel's
    /// rise.
    double tolerance_C = 0.2;
    double tolerance_share_of_rise = 0.025;
    OutlierOptions outliers;
    GapOptions gaps;
    DenoiseOptions filter;
    SweepOptions sweep;
    CriterionOptions criterion;
    SpectrumOptions spectrum;
    RegimeOptions regime;
    std::optional<SpectrumPrior> prior;  ///< what earlier tests of the machine say
    GuardOptions guards;
    std::uint64_t seed = 1;  ///< of everything that is sampled; the same seed gives the same bits
    SweepWhen sweep_when = SweepWhen::needed;
    /// With `needed`: the sweep sees the window as it was when it was last so much longer than the time
    /// before, counted from its shortest. On a noisy channel a sweep takes seconds, and 4 min more of 100
    /// change no curve.
    double sweep_growth = 0.04;
    /// A longer window is averaged down to so many samples before the sweep, whose time and memory grow with
    /// them. 13 h at 15 s.
    std::size_t longest_sweep_scans = 3200;
    /// And before all else to so many: 8 days at 15 s, 14 h at 1 s.
    std::size_t longest_window_scans = 50'000;
};

/// All structural channels at the end of one window, in the window's order.
struct WindowVerdict {
    double window_end_min = 0.0;
    double regime_since_min = 0.0;  ///< when the regime began that the window ends in
    double last_change_min = 0.0;  ///< of the machine's inputs or, by a jump, of the room; the window's start
                                   ///< if there is none
    std::string
        archive_dropped;  ///< why the archive's prior was not used on this window; empty when it was, or none
    std::optional<ArchivedSpectrum>
        spectrum;  ///< what this test would leave for the archive if it ended here
    std::vector<ChannelVerdict> channels;
};

/// The live flow from the window to the verdict on each channel: what the daemon, `thermbalctl replay` and
/// `identify` all run. A verdict depends on the window and the options and on nothing else; a LiveFlow only
/// remembers what it has computed of shorter windows, so that a growing window costs less. One thread at a
/// time.
class LiveFlow {
  public:
    explicit LiveFlow(FlowOptions options) : options_(std::move(options)) {}

    /// Errors: refuse_input when the window cannot be identified at all (no structural channel, unknown
    /// ambient), retry when it is still too short for anything, stop when `cancelled` said so. `settled` says
    /// of which channels the verdict is no longer asked: those with a standing declaration are still
    /// estimated, so that it can be contradicted, but not swept again.
    Result<WindowVerdict> identify(const TestWindow& window, const std::set<std::string>& settled,
                                   const ParallelFor& parallel_for, const std::function<bool()>& cancelled);

    const FlowOptions& options() const { return options_; }

  private:
    void forget_before(double window_end_s, double period_s);
    bool sweep_is_wanted(const ChannelVerdict& channel) const;
    Result<ChannelSweep> swept(const TestWindow& seen, const std::string& channel,
                               const ParallelFor& parallel_for, const std::function<bool()>& cancelled);
    /// Puts what is not known yet of these windows of one regime into `estimates_`.
    void estimate(const std::vector<const TestWindow*>& windows, const std::vector<double>& start_level_C,
                  const ParallelFor& parallel_for);

    FlowOptions options_;
    std::map<std::pair<std::int64_t, std::size_t>, Result<ArchivedEstimate>>
        estimates_;  // by start and scans
    struct Sweep {
        std::pair<std::int64_t, std::size_t> window;  // start and scans
        Result<ChannelSweep> result;
    };
    std::map<std::string, Sweep> sweeps_;  // the newest of each channel
};

}  // namespace thermbal
