#include <algorithm>
#include <utility>

#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    const double growth_per_K = effect.values[0];
    const std::size_t node = network.node_of_source(effect.at);
    // The housing is what the node's heat flows into: its neighbours, each by its conductance.
    auto housing = network.links_of(node);
    double sum = 0.0;
    for (const auto& [neighbour, conductance] : housing) sum += conductance;
    for (auto& [neighbour, share] : housing) share /= sum;
    network.multiply_source(effect.at, [=, shares = std::move(housing)](const NetworkState& state) {
        double housing_C = 0.0;
        for (const auto& [neighbour, share] : shares) housing_C += share * state.node_C[neighbour];
        return shares.empty() ? 1.0 : std::max(0.0, 1.0 + growth_per_K * (state.node_C[node] - housing_C));
    });
}

}  // namespace

EffectDefinition preload_growth_effect() {
    return {
        .kind = "preload_growth",
        .summary = "the bearing's friction heat grows with its temperature difference to the housing",
        .where = "a source",
        .forms =
            {{.name = "linear",
              .site = EffectSite::source,
              .equation =
                  "power * max(0, 1 + growth_per_K * (T_node - T_housing)), T_housing the mean of the node's "
                  "neighbours by conductance",
              .parameters = {{.name = "growth_per_K",
                              .lower = 0,
                              .upper = 1,
                              .prior_centre = 0.03,
                              .prior_sigma = 0.05}}}},
        .source =
            "load torque f1 P dm (Harris), preload grows with stiffness * expansion * (T_inner - T_outer): "
            "thermal "
            "behaviour of rolling bearing assemblies subjected to preload",
        .look_alikes = {"friction_viscosity", "run_in_heat", "motor_heat"},
        .told_apart_by =
            "the first minutes, when the difference to the housing is made: heat rises there, falls again as "
            "the housing follows; a second speed scales it with the square of the heat",
        .attach = attach};
}

}  // namespace thermbal
