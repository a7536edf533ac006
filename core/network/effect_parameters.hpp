#pragma once

#include <limits>
#include <string>
#include <utility>

#include "network/effect.hpp"

namespace thermbal {

/// The moment at which an effect sets in: any moment of the run is as likely as any other.
inline EffectParameterDefinition onset_parameter(std::string name = "onset_s") {
    return {.name = std::move(name),
            .lower = 0,
            .upper = 1e6,
            .prior_centre = 3600,
            .prior_sigma = std::numeric_limits<double>::infinity(),
            .is_time = true};
}

/// Heat that the model lacks: some tenths of what its sources have on average, more or less by a factor of e.
inline EffectParameterDefinition heat_power_parameter() {
    return {.name = "power_W",
            .lower = 1e-3,
            .upper = 10,
            .prior_centre = 0.3,
            .prior_sigma = 1,
            .logarithmic = true,
            .prior_unit = PriorUnit::mean_source_power};
}

}  // namespace thermbal
