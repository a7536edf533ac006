#pragma once

#include <limits>
#include <string>
#include <string_view>

#include "base/error.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// How a recording that was measured to its end says where a channel settled.
struct MeasuredEndOptions {
    double mean_min = 15.0;           ///< the end is the mean of the last so many minutes
    double apart_min = 60.0;          ///< ... against the same mean so much earlier: what it still moves
    double settled_C = 0.1;           ///< settled: it moved by no more, and no more is still to come
    double time_constant_min = 60.0;  ///< of a channel that moved too little to say its own
    double least_rise_C = 0.5;
};

/// Where a channel was at the end, and the room as the channel felt it then: the measured room through a
/// first-order lag of the channel's own time constant, the time in which it went 63.2 % of its way. A machine
/// does not follow an air conditioner that cycles, and follows a day.
struct MeasuredEnd {
    double start_C = std::numeric_limits<double>::quiet_NaN();
    double mean_C = std::numeric_limits<double>::quiet_NaN();
    double room_C = std::numeric_limits<double>::quiet_NaN();  ///< felt; NaN without an ambient channel
    double time_constant_min = std::numeric_limits<double>::quiet_NaN();
    double moved_C = std::numeric_limits<double>::quiet_NaN();  ///< over apart_min, above the felt room
    double still_to_come_C =
        std::numeric_limits<double>::quiet_NaN();  ///< if it goes on with that time constant
    bool settled = false;
    std::string figures;  ///< for a person

    /// Where the channel settles while the room stays at `room_C`, with a gain of 1: mean_C, moved by how far
    /// the room is from what was felt. mean_C where there is no room.
    double settles_at_C(double room_at_C) const;
};

/// `regime`: the recording from its last change of inputs on (the whole test without one). Errors
/// (refuse_input): no such channel or ambient, no good sample of either in the last mean_min, a recording
/// shorter than mean_min + apart_min.
Result<MeasuredEnd> measured_end(const TestWindow& regime, std::string_view channel, std::string_view ambient,
                                 const MeasuredEndOptions& options);

/// Mean of the good samples of the `mean_min` that end at `until_s`; NaN where there is none.
double mean_before_C(const TestWindow& window, std::string_view channel, double until_s, double mean_min);

}  // namespace thermbal
