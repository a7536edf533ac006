#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

enum class RegimeKind {
    speed_step,    ///< the logged speed changed
    spindle_stop,  ///< the logged speed fell to zero
    ambient_jump,  ///< the room's temperature jumped (door)
    unexplained,   ///< the channels bend together, and no input says why
};

std::string_view to_string(RegimeKind kind);

struct RegimeChange {
    double time_s = 0.0;
    RegimeKind kind = RegimeKind::unexplained;
    double size = 0.0;  ///< rpm, C, or for an unexplained change the joint chi-square that the kink explains
    double share_explained = 1.0;  ///< of the joint misfit (unexplained only)
    bool restarts_window = true;   ///< a jump of the measured room is an input, not a new machine
};

struct RegimeOptions {
    std::string speed_input = "spindle_rpm";
    double speed_share = 0.03;    ///< a speed step is a change by more than this share of the highest speed
    double ambient_jump_C = 0.8;  ///< least change of the room within `ambient_within_min`
    double ambient_within_min = 5.0;
    double ambient_over_usual = 3.0;  ///< and this many times what is usual for the room
    double kink_statistic = 150.0;    ///< least joint chi-square of an unexplained change
    double kink_share = 0.45;         ///< and least share of the joint misfit that it explains
    double kink_size_C = 0.15;        ///< and least effect within the window on some channel
    double earliest_kink_min = 8.0;   ///< unexplained changes are looked for from here ...
    double kink_margin_min = 3.0;     ///< ... to this long before the window's end
    bool search_unexplained = true;
};

struct RegimeReport {
    std::vector<RegimeChange> changes;  ///< by time
    double usable_from_s = 0.0;         ///< the window may begin here: after the last change that restarts it
    double last_change_s = 0.0;         ///< start of the window if there is none
};

/// Finds where the machine or its surroundings changed within `window`: speed from the input, jumps of the
/// ambient channel (empty: none), and kinks that all channels share and no input explains. A kink at c is the
/// response 1 - exp(-(t-c)/tau), tau = 4 and 30 min, beyond everything that decaying exponentials from the
/// window's start can represent; it counts if the joint chi-square it explains is large, if it explains most
/// of the joint misfit (a cycling chiller is a misfit that no single kink explains), and if its effect is not
/// negligible. The search repeats on what follows a change found. Pure; any thread.
RegimeReport find_regime_changes(const TestWindow& window, std::string_view ambient,
                                 const RegimeOptions& options);

}  // namespace thermbal
