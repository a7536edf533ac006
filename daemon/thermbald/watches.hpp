#pragma once

#include <vector>

#include "acquisition/alarm_watch.hpp"
#include "acquisition/freeze_watch.hpp"
#include "config/config.hpp"

namespace thermbal {

/// The units of the configuration, each with its channels, for FreezeWatch.
std::vector<WatchedModule> watched_modules(const Config& config);

/// The [[alarm]] tables, for AlarmWatch.
std::vector<AlarmLimit> alarm_limits(const Config& config);

}  // namespace thermbal
