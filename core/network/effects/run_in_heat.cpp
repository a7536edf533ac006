#include <cmath>

#include "effect_parameters.hpp"
#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    const double power_W = effect.values[0];
    const double time_constant_s = effect.values[1];
    const std::size_t source = effect.at;
    const bool at_any_speed = effect.form == 1;
    network.add_heat(
        network.node_of_source(source),
        [=](const NetworkState& state) {
            const double drive = state.source_drive[source];
            const double share = at_any_speed && drive > 0.0 ? 1.0 : drive;
            return power_W * share * std::exp(-state.time_s / time_constant_s);
        },
        Variation::smooth);
}

std::vector<EffectParameterDefinition> run_in_parameters() {
    return {heat_power_parameter(),
            {.name = "time_constant_s",
             .lower = 120,
             .upper = 36000,
             .prior_centre = 2400,
             .prior_sigma = 0.8,
             .logarithmic = true}};
}

}  // namespace

EffectDefinition run_in_heat_effect() {
    return {.kind = "run_in_heat",
            .summary = "additional bearing heat that dies away in time, whatever the temperature",
            .where = "a source",
            .forms =
                {{.name = "exponential",
                  .site = EffectSite::source,
                  .equation =
                      "+ power_W * drive * exp(-t / time_constant_s), drive as the source's column scales it",
                  .parameters = run_in_parameters()},
                 {.name = "any_speed",
                  .site = EffectSite::source,
                  .equation = "+ power_W * exp(-t / time_constant_s) while the source is driven",
                  .parameters = run_in_parameters()}},
            .source =
                "grease churning: high torque that drops to its steady value, up to 10 h (Tribology "
                "International 108375; "
                "NSK TechTalk on run-in)",
            .look_alikes = {"friction_viscosity", "slow_structure", "ambient_drift"},
            .told_apart_by =
                "a second run on the same day or a warm start: friction that follows temperature starts low "
                "then, "
                "run-in that is over does not come back",
            .attach = attach};
}

}  // namespace thermbal
