#pragma once

#include <vector>

#include "network/effect.hpp"

namespace thermbal {

/// The values of an effect's form, in its order; absent ones at their neutral value. REQUIRES: check_model.
std::vector<double> effect_values(const EffectDefinition& definition, const Effect& effect);

/// The effect with its place resolved. `values` and the effect outlive it. REQUIRES: check_model.
PlacedEffect place(const EffectDefinition& definition, const Effect& effect, const Model& model,
                   std::span<const double> values);

}  // namespace thermbal
