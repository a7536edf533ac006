#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    network.add_node_behind(effect.at, effect.values[0], effect.values[1]);
}

}  // namespace

EffectDefinition slow_structure_effect() {
    return {
        .kind = "slow_structure",
        .summary = "a large mass behind a node that the model lacks",
        .where = "a node",
        .forms = {{.name = "mass",
                   .site = EffectSite::node,
                   .equation = "heat_capacity_J_per_K dT_s/dt = conductance_W_per_K (T_node - T_s); T_s "
                               "starts as the node",
                   .parameters = {{.name = "heat_capacity_J_per_K",
                                   .lower = 0.01,
                                   .upper = 1000,
                                   .prior_centre = 1,
                                   .prior_sigma = 1.5,
                                   .logarithmic = true,
                                   .prior_unit = PriorUnit::mean_capacity},
                                  {.name = "conductance_W_per_K",
                                   .lower = 1e-3,
                                   .upper = 100,
                                   .prior_centre = 1,
                                   .prior_sigma = 1,
                                   .logarithmic = true,
                                   .prior_unit = PriorUnit::mean_conductance}}}},
        .source = "lumped conduction through a joint: 1e3 to 1e4 W/m2K in contact; column and bed weigh tons",
        .look_alikes = {"run_in_heat", "ambient_drift", "sensor_lag"},
        .told_apart_by =
            "a cool-down: the mass gives the heat back, slowly, to the same node; heat that died away does "
            "not "
            "come back",
        .attach = attach};
}

}  // namespace thermbal
