#include <cmath>

#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    const double beta_per_K = effect.values[0];
    const double reference_C = effect.values[1];
    const std::size_t node = network.node_of_source(effect.at);
    network.multiply_source(effect.at, [=](const NetworkState& state) {
        return std::exp(-beta_per_K * (state.node_C[node] - reference_C));
    });
}

}  // namespace

EffectDefinition friction_viscosity_effect() {
    return {.kind = "friction_viscosity",
            .summary = "the bearing's friction heat falls as its lubricant warms",
            .where = "a source",
            .forms = {{.name = "exponential",
                       .site = EffectSite::source,
                       .equation = "power * exp(-beta_per_K * (T_node - reference_C))",
                       .parameters = {{.name = "beta_per_K",
                                       .lower = 0,
                                       .upper = 0.1,
                                       .prior_centre = 0.015,
                                       .prior_sigma = 0.015},
                                      {.name = "reference_C",
                                       .lower = -20,
                                       .upper = 100,
                                       .prior_centre = 20,
                                       .prior_sigma = 5,
                                       .when_absent = 20.0}}}},
            .source =
                "viscous torque ~ (nu n)^(2/3) (Palmgren; Harris, Rolling Bearing Analysis), ln nu falls by "
                "0.03 to 0.06 "
                "per K (Walther, ASTM D341): up to 0.04 per K of the viscous share",
            .look_alikes = {"surface_nonlinearity", "run_in_heat", "preload_growth"},
            .told_apart_by =
                "a second speed or a warm start: it follows the node's temperature, run_in_heat the time; a "
                "cool-down: without heat it is gone, a nonlinear surface stays",
            .attach = attach};
}

}  // namespace thermbal
