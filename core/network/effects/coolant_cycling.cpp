#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

constexpr double flat = std::numeric_limits<double>::infinity();
/// Each switching is a step of the simulation: a month at this period is half a million.
constexpr double shortest_period_s = 10.0;
enum Form : std::size_t { square_wave, thermostat };

void attach_square_wave(const PlacedEffect& effect, NetworkBuilder& network) {
    const double power_W = effect.values[0];
    const double period_s = effect.values[1];
    const double duty = effect.values[2];
    const double first_on_s = effect.values[3];
    const double first_cycle = std::max(0.0, std::floor((network.start_s() - first_on_s) / period_s));
    for (double on_s = first_on_s + first_cycle * period_s; on_s < network.end_s(); on_s += period_s) {
        network.add_break(on_s);
        network.add_break(on_s + duty * period_s);
    }
    network.add_heat(
        effect.at,
        [=](const NetworkState& state) {
            const double cycles = (state.step_middle_s - first_on_s) / period_s;
            return cycles >= 0.0 && cycles - std::floor(cycles) < duty ? -power_W : 0.0;
        },
        Variation::steps);
}

void attach_seen(const PlacedEffect& effect, std::vector<double> moments_s, NetworkBuilder& network) {
    for (const double moment_s : moments_s) network.add_break(moment_s);
    network.add_heat(
        effect.at,
        [power_W = effect.values[0], moments_s = std::move(moments_s)](const NetworkState& state) {
            const auto switched =
                std::ranges::upper_bound(moments_s, state.step_middle_s) - moments_s.begin();
            return switched % 2 == 1 ? -power_W : 0.0;
        },
        Variation::steps);
}

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    if (effect.form == square_wave) return attach_square_wave(effect, network);
    auto seen_s = network.seen_switchings_s(effect.at_name);
    if (!seen_s.empty()) return attach_seen(effect, std::move(seen_s), network);
    const double on_C = effect.values[1];
    network.add_thermostat(
        {.node = effect.at, .power_W = effect.values[0], .on_C = on_C, .off_C = on_C - effect.values[2]});
}

EffectParameterDefinition power() {
    return {.name = "power_W",
            .lower = 1e-3,
            .upper = 30,
            .prior_centre = 0.5,
            .prior_sigma = 1,
            .logarithmic = true,
            .prior_unit = PriorUnit::mean_source_power};
}

}  // namespace

EffectDefinition coolant_cycling_effect() {
    return {
        .kind = "coolant_cycling",
        .summary = "a chiller that a thermostat switches on and off takes heat away",
        .where = "a node",
        .forms = {{.name = "square_wave",
                   .site = EffectSite::node,
                   .equation = "-power_W while frac((t - first_on_s) / period_s) < duty, from first_on_s on",
                   .parameters = {power(),
                                  {.name = "period_s",
                                   .lower = 60,
                                   .upper = 14400,
                                   .prior_centre = 900,
                                   .prior_sigma = 0.8,
                                   .logarithmic = true,
                                   .least_accepted = shortest_period_s},
                                  {.name = "duty",
                                   .lower = 0.02,
                                   .upper = 0.98,
                                   .prior_centre = 0.5,
                                   .prior_sigma = 0.2,
                                   .when_absent = 0.5,
                                   .least_accepted = 0,
                                   .most_accepted = 1},
                                  {.name = "first_on_s",
                                   .lower = -14400,
                                   .upper = 1e6,
                                   .prior_centre = 0,
                                   .prior_sigma = flat,
                                   .when_absent = 0.0,
                                   .is_time = true}}},
                  {.name = "thermostat",
                   .site = EffectSite::node,
                   .equation = "-power_W from T_node > switch_on_C until T_node < switch_on_C - hysteresis_C",
                   .parameters = {power(),
                                  {.name = "switch_on_C",
                                   .lower = -20,
                                   .upper = 200,
                                   .prior_centre = 25,
                                   .prior_sigma = flat},
                                  {.name = "hysteresis_C",
                                   .lower = 0.02,
                                   .upper = 20,
                                   .prior_centre = 1,
                                   .prior_sigma = 0.8,
                                   .logarithmic = true}},
                   .steers_itself = true}},
        .source =
            "two-point control; hysteresis of machine tool chillers 2 K (AKZ438) to 4.4 K (Hyfra VWK21), 500 "
            "to 1100 "
            "W at the compressor: EMod Cooler.xml (sizuest/EMod)",
        .look_alikes = {"ambient_drift", "spindle_stop"},
        .told_apart_by =
            "it repeats, with the same sign at one node and its neighbours; a second speed: a thermostat's "
            "period and duty change with the heat, a timer's do not",
        .attach = attach};
}

}  // namespace thermbal
