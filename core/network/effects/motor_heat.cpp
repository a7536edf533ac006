#include "effect_parameters.hpp"
#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    const double power_W = effect.values[0];
    network.add_heat(effect.at, [=](const NetworkState&) { return power_W; }, Variation::steps);
}

}  // namespace

EffectDefinition motor_heat_effect() {
    return {
        .kind = "motor_heat",
        .summary = "a steady heat source that the model lacks",
        .where = "a node",
        .forms = {{.name = "constant",
                   .site = EffectSite::node,
                   .equation = "+ power_W",
                   .parameters = {heat_power_parameter()}}},
        .source =
            "copper and iron losses of a drive at constant speed and load are constant but for 0.4 % per K",
        .look_alikes = {"preload_growth", "cutting_heat", "sensor_offset"},
        .told_apart_by =
            "it warms its node more than any change of the model's own powers and conductances can, from the "
            "first minute on; cutting_heat begins later",
        .attach = attach};
}

}  // namespace thermbal
