#include <algorithm>
#include <cmath>

#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

/// Kinematic viscosity in mm2/s of a mineral oil ISO VG 32, viscosity index 95 (32 at 40 C, 5.35 at 100 C),
/// as in spindle greases: ASTM D341, Walther's equation.
double viscosity_mm2_per_s(double oil_C) {
    constexpr double level = 9.5958, slope = 3.7726;
    return std::pow(10.0, std::pow(10.0, level - slope * std::log10(oil_C + 273.15))) - 0.7;
}

/// Palmgren: the viscous part of the torque goes with (nu n)^(2/3).
double viscous_torque(double oil_C) {
    constexpr double coldest_C = -40.0, warmest_C = 200.0;  // beyond, the equation says nothing
    return std::cbrt(std::pow(viscosity_mm2_per_s(std::clamp(oil_C, coldest_C, warmest_C)), 2.0));
}

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    const std::size_t node = network.node_of_source(effect.at);
    const double size = effect.values[0];
    const double reference_C = effect.values[1];
    if (effect.form == 0) {
        network.multiply_source(effect.at, [=](const NetworkState& state) {
            return std::exp(-size * (state.node_C[node] - reference_C));
        });
        return;
    }
    const double at_reference = viscous_torque(reference_C);
    network.multiply_source(effect.at, [=](const NetworkState& state) {
        return 1.0 - size + size * viscous_torque(state.node_C[node]) / at_reference;
    });
}

EffectParameterDefinition reference_parameter() {
    return {.name = "reference_C",
            .lower = -20,
            .upper = 100,
            .prior_centre = 20,
            .prior_sigma = 5,
            .when_absent = 20.0};
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
                                      reference_parameter()}},
                      {.name = "viscous_share",
                       .site = EffectSite::source,
                       .equation = "power * (1 - viscous_share + viscous_share * (nu(T_node) / "
                                   "nu(reference_C))^(2/3)), nu of an ISO VG 32 oil",
                       .parameters = {{.name = "viscous_share",
                                       .lower = 0,
                                       .upper = 1,
                                       .prior_centre = 0.5,
                                       .prior_sigma = 0.3,
                                       .least_accepted = 0,
                                       .most_accepted = 1},
                                      reference_parameter()}}},
            .source =
                "viscous torque ~ (nu n)^(2/3), the rest follows the load (Palmgren; Harris, Rolling Bearing "
                "Analysis), ln nu falls by 0.03 to 0.06 per K (Walther, ASTM D341): up to 0.04 per K of the "
                "viscous share",
            .look_alikes = {"surface_nonlinearity", "run_in_heat", "preload_growth"},
            .told_apart_by =
                "a second speed or a warm start: it follows the node's temperature, run_in_heat the time; a "
                "cool-down: without heat it is gone, a nonlinear surface stays",
            .attach = attach};
}

}  // namespace thermbal
