#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace thermbal {

/// The answer to `health` as lines of the log: one of the daemon, and one of each unit of each line. Errors
/// and classes of the histogram that never happened are left out. Pure.
std::vector<std::string> health_log(const nlohmann::json& health);

}  // namespace thermbal
