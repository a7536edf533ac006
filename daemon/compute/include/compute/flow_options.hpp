#pragma once

#include "config/config.hpp"
#include "declaration/live_flow.hpp"

namespace thermbal {

/// What the configuration says of the live flow. Which channel is the room, and what earlier tests say, is
/// the caller's; every other option keeps core's default.
FlowOptions flow_options(const IdentificationConfig& identification);

}  // namespace thermbal
