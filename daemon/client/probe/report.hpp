#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "scan.hpp"

namespace thermbal {

/// What the probe saw, for a person: units, the best readings with their values, profiles that fit.
std::string probe_text(const ProbeResult& result);

nlohmann::json probe_json(const ProbeResult& result);

/// What to start from, of the units that something could be made of.
struct StartingPoint {
    std::string profile_name;  ///< of the new profile; empty where a shipped one fits
    std::string profile_toml;
    std::string config_toml;
};

/// A configuration that `thermbald --check-config` accepts as soon as the profile lies in a profiles folder
/// (or beside it, named by a path). Error (stop) when no unit gave temperatures.
Result<StartingPoint> starting_point(const ProbeResult& result);

}  // namespace thermbal
