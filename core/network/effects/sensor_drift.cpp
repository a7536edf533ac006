#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    const double rate_C_per_s = effect.values[0] / 3600.0;
    const double start_s = network.start_s();
    network.add_to_reading(effect.at, [=](double time_s) { return rate_C_per_s * (time_s - start_s); });
}

}  // namespace

EffectDefinition sensor_drift_effect() {
    return {
        .kind = "sensor_drift",
        .summary = "a sensor's reading wanders off steadily",
        .where = "a channel",
        .forms = {{.name = "linear",
                   .site = EffectSite::channel,
                   .equation = "reading + rate_C_per_h * (t - start) / 3600",
                   .parameters = {{.name = "rate_C_per_h",
                                   .lower = -10,
                                   .upper = 10,
                                   .prior_centre = 0,
                                   .prior_sigma = 0.5}}}},
        .source = "self-heating and lead resistance that change with the electronics' temperature; aging",
        .look_alikes = {"slow_structure", "ambient_drift", "sensor_offset"},
        .told_apart_by = "the neighbours stay; it goes on after everything has settled, in a cool-down too",
        .attach = attach};
}

}  // namespace thermbal
