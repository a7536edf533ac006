#include "effect_parameters.hpp"
#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    network.stop_sources(effect.values[1], effect.values[1] + effect.values[0]);
}

}  // namespace

EffectDefinition spindle_stop_effect() {
    return {
        .kind = "spindle_stop",
        .summary = "the spindle stood still for a while that nobody logged",
        .where = "all sources",
        .forms = {{.name = "window",
                   .site = EffectSite::whole_model,
                   .equation = "every source is 0 from from_s to from_s + duration_s",
                   // From a tool change of seconds to a break of hours.
                   .parameters = {{.name = "duration_s",
                                   .lower = 4,
                                   .upper = 36000,
                                   .prior_centre = 240,
                                   .prior_sigma = 1.8,
                                   .logarithmic = true},
                                  onset_parameter("from_s")}}},
        .source = "no rotation, no friction",
        .look_alikes = {"coolant_cycling"},
        .told_apart_by =
            "every heated node falls at the same moment, in proportion to its own heat, and all come back at "
            "another; it does not repeat",
        .attach = attach};
}

}  // namespace thermbal
