#include "effect_parameters.hpp"
#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    network.detach_sensor({.sensor = effect.at,
                           .ambient_share = effect.values[0],
                           .from_s = effect.values[1],
                           .time_constant_s = effect.form == 0 ? 0.0 : effect.values[2]});
}

EffectParameterDefinition ambient_share_parameter() {
    return {.name = "ambient_share",
            .lower = 0,
            .upper = 1,
            .prior_centre = 0.5,
            .prior_sigma = 0.25,
            .least_accepted = 0,
            .most_accepted = 1};
}

/// Of the sensor itself, once the air cools it instead of the surface: faster than what lags behind a node.
EffectParameterDefinition time_constant_parameter() {
    return {.name = "time_constant_s",
            .lower = 1,
            .upper = 1800,
            .prior_centre = 60,
            .prior_sigma = 1,
            .logarithmic = true};
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
                   .parameters = {ambient_share_parameter(), onset_parameter()}},
                  {.name = "gradual",
                   .site = EffectSite::channel,
                   .equation = "step, the share times 1 - exp(-(t - onset_s) / time_constant_s)",
                   .parameters = {ambient_share_parameter(), onset_parameter(), time_constant_parameter()},
                   .refines_first = true}},
        .source =
            "stem conduction and a lost contact: a weighted mean of surface and air (Fluke, immersion "
            "rules); stick-on PT100 10 to 60 s on a surface, more in still air",
        .look_alikes = {"airflow_change", "sensor_drift", "cutting_heat"},
        .told_apart_by =
            "one channel jumps within a scan or some minutes, faster than its mass allows; its neighbours do "
            "not move",
        .attach = attach};
}

}  // namespace thermbal
