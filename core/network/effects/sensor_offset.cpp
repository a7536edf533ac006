#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    const double offset_C = effect.values[0];
    network.add_to_reading(effect.at, [=](double) { return offset_C; });
}

}  // namespace

EffectDefinition sensor_offset_effect() {
    return {.kind = "sensor_offset",
            .summary = "a sensor reads a constant too much",
            .where = "a channel",
            .forms = {{.name = "constant",
                       .site = EffectSite::channel,
                       .equation = "reading + offset_C, from the first reading on",
                       .parameters = {{.name = "offset_C",
                                       .lower = -20,
                                       .upper = 20,
                                       .prior_centre = 0,
                                       .prior_sigma = 1}}}},
            .source = "IEC 60751: class B +-(0.30 + 0.005 T); 1 ohm of lead in two-wire connection 2.6 K",
            .look_alikes = {"motor_heat", "sensor_drift"},
            .told_apart_by =
                "it is there before the spindle starts, when the whole machine is as warm as the room",
            .attach = attach};
}

}  // namespace thermbal
