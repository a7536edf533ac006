#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "simulator/plant.hpp"

namespace thermbal {

/// A vertical machining centre's spindle head in cast iron, with column, bed and table: 21 bodies, 15
/// structural sensors (T2 ... T16) and the room's (T1).
PlantDescription spindle_head();

/// A test of Feng, Xia, Sun and Fu (2015) that the spindle head is tuned to: what its T5 does.
struct Condition {
    std::string name;
    Drive drive;
    double room_C = 18.0;
    double paper_steady_state_C = 0.0;
    double paper_equilibrium_time_min = 0.0;
};

const std::vector<Condition>& conditions();
std::optional<Condition> find_condition(std::string_view name);

}  // namespace thermbal
