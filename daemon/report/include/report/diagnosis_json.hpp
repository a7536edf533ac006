#pragma once

#include <nlohmann/json.hpp>

#include "gap/diagnose.hpp"

namespace thermbal {

/// The document of `thermbalctl diagnose --json` (INTERFACES). Beyond it: `reason`, `suspects` (what it might
/// be where nothing is named), `residual_heat`, per-channel figures under `gap`, intervals under each effect.
nlohmann::json diagnosis_to_json(const Diagnosis& diagnosis);

}  // namespace thermbal
