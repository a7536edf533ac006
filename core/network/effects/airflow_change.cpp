#include "effect_parameters.hpp"
#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    network.change_surface({.node = effect.at, .factor = effect.values[0], .from_s = effect.values[1]});
}

}  // namespace

EffectDefinition airflow_change_effect() {
    return {.kind = "airflow_change",
            .summary = "the heat transfer to the air changes at some moment",
            .where = "a link to the ambient",
            .forms = {{.name = "step",
                       .site = EffectSite::ambient_link,
                       .equation = "conductance * factor from onset_s on",
                       .parameters = {{.name = "factor",
                                       .lower = 0.05,
                                       .upper = 20,
                                       .prior_centre = 1,
                                       .prior_sigma = 0.6,
                                       .logarithmic = true},
                                      onset_parameter()}}},
            .source =
                "a door, a fan, a coolant jet: still air 5 to 10, moved air 10 to 50 W/m2K (VDI-Waermeatlas; "
                "EMod "
                "Fluid.java)",
            .look_alikes = {"cutting_heat", "surface_nonlinearity", "sensor_detached"},
            .told_apart_by =
                "its heat is proportional to the surface's difference to the room: a cool-down keeps it and "
                "a heat "
                "source does not",
            .attach = attach};
}

}  // namespace thermbal
