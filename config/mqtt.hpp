#pragma once

#include <string>

#include "config/config.hpp"
#include "toml_reader.hpp"

namespace thermbal {

/// The section [mqtt]: to which broker thermbal-mqtt sends.
MqttConfig read_mqtt(TableReader& reader);

/// The section as TOML; no secret stands in it, only where secrets are.
std::string explain_mqtt(const MqttConfig& mqtt);

}  // namespace thermbal
