#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "declaration/guard.hpp"
#include "declaration/live_flow.hpp"
#include "declaration/measured_end.hpp"
#include "modes/information_limit.hpp"

namespace thermbal {

/// What one estimator says of one channel on one window. NaN where it has no answer.
struct EstimatorAnswer {
    double steady_state_C = std::numeric_limits<double>::quiet_NaN();
    double steady_state_low_C =
        std::numeric_limits<double>::quiet_NaN();  ///< central 90 % interval, if it has one
    double steady_state_high_C = std::numeric_limits<double>::quiet_NaN();
    double equilibrium_time_min = std::numeric_limits<double>::quiet_NaN();  ///< since the start of the test
    std::vector<Guard> guards;  ///< what it says about itself: the SVR's "clear_minimum"
    std::string note;           ///< why there is no answer, or what was dropped; empty otherwise
};

/// What an estimator is given: a window that begins with its regime.
struct EstimatorInput {
    const TestWindow& window;
    const std::vector<double>& start_level_C;  ///< as estimate_spectrum; empty without an earlier regime
    const std::vector<std::string>& channels;  ///< that are asked for, without the ambient
    const FlowOptions& options;
    const ParallelFor& parallel_for;
};

/// One way to say where the channels settle: one answer a channel of input.channels.
struct Estimator {
    std::string_view name;  ///< "svr", a JSON key
    std::string_view what;  ///< for a person
    bool needs_prior;       ///< only asked when options.prior is set
    std::vector<EstimatorAnswer> (*answer)(const EstimatorInput& input);
};

/// All there are: svr, one_exponential, two_exponentials, kalman, modes, modes_and_svr, modes_with_archive.
std::span<const Estimator> all_estimators();

struct ComparedWindow {
    double window_end_min = 0.0;
    double regime_since_min = 0.0;
    std::vector<std::vector<EstimatorAnswer>> answers;  ///< [estimator][channel]
};

/// Every one of `estimators` on the regime that `window` ends in. Pure; the same arguments give the same
/// answers. `channels`: those asked for; the shared modes see all of them all the same.
ComparedWindow compare_estimators(const TestWindow& window, std::span<const Estimator> estimators,
                                  const std::vector<std::string>& channels, const FlowOptions& options,
                                  const ParallelFor& parallel_for);

/// What a complete recording says in the end, to hold the windows against.
struct RecordingEnd {
    double regime_since_min = 0.0;  ///< windows that end before it belong to another regime
    std::vector<Result<MeasuredEnd>> channels;
    /// The few shared exponentials that describe the recording, for the information limit; an error where
    /// none do.
    Result<SharedModes> modes;
};

RecordingEnd end_of_recording(const TestWindow& recording, const std::vector<std::string>& channels,
                              const FlowOptions& options, const MeasuredEndOptions& end_options = {});

/// The information limit at the end of a window, by channel of `channels`: the least half width of a 90 %
/// interval of an unbiased estimate, in C, all channels together or one alone. Infinite where the samples do
/// not determine it, NaN where the recording's modes are not known.
std::vector<double> least_half_width_C(const RecordingEnd& end, const std::vector<std::string>& channels,
                                       double period_s, double window_end_min, SharedKnowledge knowledge);

/// The earliest minute of the test at which that is within `tolerance_C`, all channels together; infinite
/// where it never is before `latest_min`.
std::vector<double> earliest_knowable_min(const RecordingEnd& end, const std::vector<std::string>& channels,
                                          double period_s, double tolerance_C, double latest_min);

}  // namespace thermbal
