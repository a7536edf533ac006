#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    network.lag_sensor(effect.at, effect.values[0]);
}

}  // namespace

EffectDefinition sensor_lag_effect() {
    return {
        .kind = "sensor_lag",
        .summary = "a sensor follows its node late",
        .where = "a channel",
        .forms = {{.name = "first_order",
                   .site = EffectSite::channel,
                   .equation = "time_constant_s d(reading)/dt = T_node - reading",
                   .parameters = {{.name = "time_constant_s",
                                   .lower = 1,
                                   .upper = 7200,
                                   .prior_centre = 120,
                                   .prior_sigma = 1,
                                   .logarithmic = true}}}},
        .source =
            "apmonitor.com, TCLab higher-order model; magnetic and stick-on PT100 10 to 60 s, badly coupled "
            "minutes",
        .look_alikes = {"slow_structure"},
        .told_apart_by =
            "the neighbours: they are where the node says, only this channel comes late; every step of speed "
            "and every cool-down is late by the same time",
        .attach = attach};
}

}  // namespace thermbal
