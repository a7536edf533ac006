#pragma once

#include "config/config.hpp"
#include "declaration/live_flow.hpp"

namespace thermbal {

/// What the configuration says of the live flow; every other option keeps core's default.
FlowOptions flow_options(const Config& config);

}  // namespace thermbal
