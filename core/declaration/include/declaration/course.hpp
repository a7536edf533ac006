#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "declaration/live_flow.hpp"

namespace thermbal {

/// What the shared time constants expect of one channel, and the whole course that leads there.
struct ExpectedCourse {
    std::string channel;
    double steady_state_C = 0.0;
    double steady_state_low_C = 0.0;  ///< central 90 % interval
    double steady_state_high_C = 0.0;
    std::vector<double> temperature_C;  ///< one a time that was asked for; NaN before the regime began
};

/// The paper's regression at one grid point, run freely: its Figs. 6 and 7 are this against the measurement.
struct RegressionCourse {
    double first_s = 0.0;  ///< of the first value, since the start of the test
    double period_s = 15.0;
    std::vector<double> temperature_C;  ///< one a scan: over the window, then `scans_after` beyond it
};

struct Regime;

/// The courses behind the verdicts of LiveFlow::identify on the same window with the same options: what a
/// plot shows where a verdict only has the end. Every call is pure and may run on any thread.
class VerdictCourses {
  public:
    /// Looks for the regime that the window ends in, once. The options outlive it.
    VerdictCourses(const TestWindow& window, const FlowOptions& options);

    /// `time_s` since the start of the test, rising; beyond the window the room stays at its mean over the
    /// last minutes. Errors: those of estimate_spectrum.
    Result<std::vector<ExpectedCourse>> expected(std::span<const double> time_s) const;

    /// `n`, `C` and `sigma` as a verdict on this window says. Errors (refuse_input): no such channel, or its
    /// samples do not allow a regression.
    Result<RegressionCourse> regression(const SvrPrediction& at, const std::string& channel,
                                        std::size_t scans_after) const;

  private:
    std::shared_ptr<const Regime> regime_;
    const FlowOptions& options_;
};

}  // namespace thermbal
