#include <cmath>

#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    const double half_exponent = 0.5 * effect.values[0];
    const double reference_C = effect.values[1];
    // Below about 1 K the air moves for other reasons than the surface: the power law ends there, smoothly.
    constexpr double still_C = 1.0;
    network.multiply_surfaces([=](double difference_C) {
        const double relative =
            (difference_C * difference_C + still_C * still_C) / (reference_C * reference_C);
        return std::pow(relative, half_exponent);
    });
}

}  // namespace

EffectDefinition surface_nonlinearity_effect() {
    return {
        .kind = "surface_nonlinearity",
        .summary = "natural convection and radiation: the loss grows faster than the temperature difference",
        .where = "links to the ambient",
        .forms =
            {{.name = "power_law",
              .site = EffectSite::whole_model,
              .equation =
                  "conductance * ((dT^2 + 1 K^2) / reference_difference_C^2)^(exponent / 2), dT = T_node - "
                  "T_room",
              .parameters =
                  {{.name = "exponent", .lower = 0, .upper = 1.5, .prior_centre = 0.25, .prior_sigma = 0.2},
                   {.name = "reference_difference_C",
                    .lower = 1,
                    .upper = 200,
                    .prior_centre = 10,
                    .prior_sigma = 1,
                    .when_absent = 10.0}}}},
        .source =
            "free convection Nu ~ Ra^(1/4) laminar, Ra^(1/3) turbulent (VDI-Waermeatlas; EMod Fluid.java); "
            "radiation "
            "eps sigma (T^4 - T_room^4) adds 0.5 % per K to its share",
        .look_alikes = {"friction_viscosity", "airflow_change"},
        .told_apart_by =
            "a cool-down: it slows towards the end, without any source; friction that falls with temperature "
            "is "
            "then silent",
        .attach = attach};
}

}  // namespace thermbal
