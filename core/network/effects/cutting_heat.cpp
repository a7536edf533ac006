#include "effect_parameters.hpp"
#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    const double power_W = effect.values[0];
    const double onset_s = effect.values[1];
    network.add_break(onset_s);
    network.add_heat(
        effect.at, [=](const NetworkState& state) { return state.step_middle_s >= onset_s ? power_W : 0.0; },
        Variation::steps);
}

}  // namespace

EffectDefinition cutting_heat_effect() {
    return {.kind = "cutting_heat",
            .summary = "heat that sets in at some moment and stays",
            .where = "a node",
            .forms = {{.name = "step",
                       .site = EffectSite::node,
                       .equation = "+ power_W from onset_s on",
                       .parameters = {heat_power_parameter(), onset_parameter()}}},
            .source = "the share of the cutting power that goes into tool and spindle: a step of heat",
            .look_alikes = {"airflow_change", "motor_heat", "sensor_detached"},
            .told_apart_by =
                "the kink at its onset is largest at its node and arrives later at the neighbours; a changed "
                "loss to "
                "the air is larger the warmer the surface is, and shows in a cool-down",
            .attach = attach};
}

}  // namespace thermbal
