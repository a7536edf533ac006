#pragma once

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "declaration/verdict.hpp"

namespace thermbal {

/// One element of the `channels` list of INTERFACES (identify, replay, predictions). NaN becomes null.
nlohmann::json verdict_to_json(const ChannelVerdict& verdict);

/// The inverse: a verdict that was stored. Errors (stop): not what verdict_to_json writes.
Result<ChannelVerdict> verdict_from_json(const nlohmann::json& json);

/// {"name", "passed", "figures"}.
nlohmann::json guard_to_json(const Guard& guard);

/// A finite number, or null.
nlohmann::json number_or_null(double value);

}  // namespace thermbal
