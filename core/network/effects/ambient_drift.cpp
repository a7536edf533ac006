#include <cmath>
#include <limits>
#include <numbers>

#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

constexpr double flat = std::numeric_limits<double>::infinity();
enum Form : std::size_t { ramp, wave, column };

void attach_ramp(const PlacedEffect& effect, NetworkBuilder& network) {
    const double rate_C_per_s = effect.values[0] / 3600.0;
    const double onset_s = effect.values[1];
    network.add_break(onset_s);
    network.shift_ambient(
        [=](const NetworkState& state) {
            return state.step_middle_s > onset_s ? rate_C_per_s * (state.time_s - onset_s) : 0.0;
        },
        Variation::smooth);
}

void attach_wave(const PlacedEffect& effect, NetworkBuilder& network) {
    const double amplitude_C = effect.values[0];
    const double rad_per_s = 2.0 * std::numbers::pi / (3600.0 * effect.values[1]);
    const double phase_rad = effect.values[2];
    network.shift_ambient(
        [=](const NetworkState& state) {
            return amplitude_C * (std::sin(rad_per_s * state.time_s + phase_rad) - std::sin(phase_rad));
        },
        Variation::smooth);
}

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    switch (effect.form) {
        case ramp:
            return attach_ramp(effect, network);
        case wave:
            return attach_wave(effect, network);
        default:
            return network.follow_column(effect.at_name, effect.values[0]);
    }
}

}  // namespace

EffectDefinition ambient_drift_effect() {
    return {
        .kind = "ambient_drift",
        .summary = "the room's temperature changes; the model held it constant",
        .where = "every surface",
        .forms =
            {{.name = "ramp",
              .site = EffectSite::whole_model,
              .equation = "T_room = ambient + rate_C_per_h * (t - onset_s) / 3600 from onset_s on",
              .parameters =
                  {{.name = "rate_C_per_h", .lower = -20, .upper = 20, .prior_centre = 0, .prior_sigma = 1},
                   {.name = "onset_s",
                    .lower = 0,
                    .upper = 1e6,
                    .prior_centre = 0,
                    .prior_sigma = flat,
                    .when_absent = 0.0,
                    .is_time = true}}},
             {.name = "wave",
              .site = EffectSite::whole_model,
              .equation =
                  "T_room = ambient + amplitude_C * (sin(2 pi t / period_h + phase_rad) - sin(phase_rad))",
              .parameters =
                  {{.name = "amplitude_C",
                    .lower = 0.01,
                    .upper = 20,
                    .prior_centre = 1,
                    .prior_sigma = 1,
                    .logarithmic = true},
                   {.name = "period_h",
                    .lower = 0.1,
                    .upper = 48,
                    .prior_centre = 6,
                    .prior_sigma = 1,
                    .logarithmic = true},
                   {.name = "phase_rad", .lower = -4, .upper = 4, .prior_centre = 0, .prior_sigma = flat}}},
             {.name = "column",
              .site = EffectSite::column,
              .equation = "T_room = ambient + share * (column - ambient)",
              .parameters =
                  {{.name = "share", .lower = 0, .upper = 1.5, .prior_centre = 1, .prior_sigma = 0.1}}}},
        .source =
            "ISO 230-3:2020, environmental temperature variation error: slow ramp, a day's sine, the cycle "
            "of an "
            "air conditioning; a sensor in the room measures it",
        .look_alikes = {"slow_structure", "run_in_heat", "sensor_drift"},
        .told_apart_by =
            "a channel that measures the room; without one: every surface follows, those with the largest "
            "surface and the smallest mass first, also while the spindle stands",
        .attach = attach};
}

}  // namespace thermbal
