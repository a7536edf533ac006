#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "declaration/criterion.hpp"
#include "declaration/guard.hpp"

namespace thermbal {

/// What a channel is, at the end of a window.
enum class ChannelState {
    measuring,       ///< not known yet: measure on
    declared,        ///< its steady state is known, and proved
    barely_warming,  ///< its whole rise is within the tolerance: nothing to declare, nothing to wait for
    stuck,           ///< its readings do not follow the machine any more
    dead,            ///< it has no good readings
};
std::string_view to_string(ChannelState state);

/// What the support-vector regression of the paper says by itself. NaN where it has no answer.
struct SvrPrediction {
    int n = 0;
    double steady_state_C = std::numeric_limits<double>::quiet_NaN();
    double equilibrium_time_min = std::numeric_limits<double>::quiet_NaN();
    double C = std::numeric_limits<double>::quiet_NaN();
    double sigma = std::numeric_limits<double>::quiet_NaN();
};

/// What the adaptive unscented Kalman filter says by itself: one exponential, one channel, with a 90 %
/// interval.
struct KalmanPrediction {
    double steady_state_C = std::numeric_limits<double>::quiet_NaN();
    double steady_state_low_C = std::numeric_limits<double>::quiet_NaN();
    double steady_state_high_C = std::numeric_limits<double>::quiet_NaN();
    double equilibrium_time_min = std::numeric_limits<double>::quiet_NaN();
};

/// What the paper's method says of one channel on one window.
struct ChannelSweep {
    std::vector<double> rmse_by_n_C;
    RmseMinimum minimum;
    SvrPrediction svr;
};

/// One channel at the end of one window. NaN where a figure is not known.
struct ChannelVerdict {
    std::string channel;
    ChannelState state = ChannelState::measuring;
    double window_end_min = std::numeric_limits<double>::quiet_NaN();
    double declared_at_min = std::numeric_limits<double>::quiet_NaN();  ///< the window of its figures
    /// Declared without a break since; before `declared_at_min` where the figures were renewed.
    double stands_since_min = std::numeric_limits<double>::quiet_NaN();
    int n = 0;
    double window_rmse_C = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> rmse_by_n_C;  ///< [i] belongs to n = i + 1
    double value_C =
        std::numeric_limits<double>::quiet_NaN();  ///< the filtered temperature at the window's end
    double steady_state_C = std::numeric_limits<double>::quiet_NaN();
    double steady_state_low_C = std::numeric_limits<double>::quiet_NaN();  ///< central 90 % interval
    double steady_state_high_C = std::numeric_limits<double>::quiet_NaN();
    double tolerance_C = std::numeric_limits<double>::quiet_NaN();  ///< what half the interval may be
    double room_C =
        std::numeric_limits<double>::quiet_NaN();  ///< in which it settles there; NaN: not measured
    double equilibrium_time_min =
        std::numeric_limits<double>::quiet_NaN();  ///< since the start, 95 % of the rise
    double equilibrium_time_low_min = std::numeric_limits<double>::quiet_NaN();
    double equilibrium_time_high_min = std::numeric_limits<double>::quiet_NaN();
    SvrPrediction svr;
    KalmanPrediction kalman;  ///< reported beside the SVR, no guard asks it
    std::vector<Guard>
        guards;  ///< in the order in which they were asked; the first that failed is the reason
    std::string reason;

    bool declared() const { return state == ChannelState::declared; }
};

}  // namespace thermbal
