#pragma once

#include <string>
#include <vector>

#include "base/error.hpp"
#include "simulator/plant.hpp"

namespace thermbal {

struct ChannelTruth {
    std::string channel;
    std::string node;
    double steady_state_C = 0.0;
    /// First time at which the sensor has made 95 % of its whole rise; NaN for a channel that does not rise.
    double equilibrium_time_min = 0.0;
};

struct Truth {
    std::vector<double> node_C;
    std::vector<ChannelTruth> channels;
};

/// Node temperatures at which every heat balance is zero (Newton). Error (stop) when it does not converge.
Result<std::vector<double>> steady_state_C(const PlantDescription& plant, double room_C, const Drive& drive);

/// Where the plant really settles from a cold start, and when, with the room constant and without noise.
Result<Truth> plant_truth(const PlantDescription& plant, double room_C, const Drive& drive);

}  // namespace thermbal
