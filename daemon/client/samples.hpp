#pragma once

#include <cstdint>
#include <functional>

#include <nlohmann/json.hpp>

#include "base/error.hpp"

namespace thermbal {

/// One answer of a daemon holds only so many samples: asks ("samples") for the scans behind the last one that
/// came until there are `wanted` or no more. `take` gets every answer, also the first one without scans.
/// Errors: those of `ask`; the answers before have been taken.
Result<void> ask_samples(const std::function<Result<nlohmann::json>(const nlohmann::json& params)>& ask,
                         nlohmann::json params, std::int64_t wanted,
                         const std::function<void(nlohmann::json answer)>& take);

}  // namespace thermbal
