#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/error.hpp"
#include "regression/lags.hpp"
#include "regression/svr.hpp"

namespace thermbal {

struct FreeRunOptions {
    std::size_t longest_run = 5760;  ///< samples a prediction may take to settle: 24 h at 15 s
    std::size_t settle_span = 20;    ///< samples: 5 min at 15 s
    double settle_C =
        0.002;  ///< settled: moved less than this over settle_span, and less than this is still to come
    double lowest_C = -60.0;  ///< a run that leaves this range is stopped and flagged
    double highest_C = 250.0;

    /// Errors (refuse_input) name the field, its value and the bound.
    Result<void> check() const;
};

/// A model that is fed its own predictions.
struct FreeRun {
    std::vector<double> temperature_C;  ///< one a sample, the first one sample after the start values
    bool settles = false;
    bool leaves_range = false;
    double steady_state_C = 0.0;    ///< what it converges to, NaN unless it settles
    std::size_t settled_after = 0;  ///< samples until it settled, if it settles
};

/// `steps` predictions from `start_unit` (lags() values, newest last), stopped early only where it leaves the
/// range.
FreeRun run_freely(const SvrModel& model, const UnitScale& scale, std::span<const double> start_unit,
                   std::size_t steps, const FreeRunOptions& options);

/// Predictions until the run settles, leaves the range, or has taken options.longest_run.
FreeRun run_until_settled(const SvrModel& model, const UnitScale& scale, std::span<const double> start_unit,
                          const FreeRunOptions& options);

/// The paper's eq. (7): sqrt(sum (Te - To)^2 / (m - 1)). REQUIRES: the same length, at least 2.
double root_mean_square_error_C(std::span<const double> estimated_C, std::span<const double> observed_C);

}  // namespace thermbal
