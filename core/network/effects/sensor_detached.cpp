#include "effect_parameters.hpp"
#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    network.detach_sensor(
        {.sensor = effect.at, .ambient_share = effect.values[0], .from_s = effect.values[1]});
}

}  // namespace

EffectDefinition sensor_detached_effect() {
    return {
        .kind = "sensor_detached",
        .summary = "from some moment a sensor half measures the air",
        .where = "a channel",
        .forms = {{.name = "step",
                   .site = EffectSite::channel,
                   .equation = "reading = (1 - ambient_share) T_node + ambient_share T_room from onset_s on",
                   .parameters = {{.name = "ambient_share",
                                   .lower = 0,
                                   .upper = 1,
                                   .prior_centre = 0.5,
                                   .prior_sigma = 0.25},
                                  onset_parameter()}}},
        .source =
            "stem conduction and a lost contact: a weighted mean of surface and air (Fluke, immersion rules)",
        .look_alikes = {"airflow_change", "sensor_drift", "cutting_heat"},
        .told_apart_by =
            "one channel jumps within a scan or two, faster than its mass allows; its neighbours do not move",
        .attach = attach};
}

}  // namespace thermbal
