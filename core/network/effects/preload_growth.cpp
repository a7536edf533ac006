#include <algorithm>
#include <utility>

#include "network/effect.hpp"
#include "network_builder.hpp"

namespace thermbal {
namespace {

enum Form : std::size_t { of_all_neighbours, of_first_neighbour, of_second_neighbour };

using Shares = std::vector<std::pair<std::size_t, double>>;

/// What stands for the housing: nodes and how much each counts. A bearing sits between the shaft and the
/// housing; names do not say which is which.
Shares housing_of(Shares neighbours, std::size_t form) {
    if (form != of_all_neighbours) {
        const std::size_t wanted = form - of_first_neighbour;
        if (neighbours.size() <= wanted) return {};
        return {{neighbours[wanted].first, 1.0}};
    }
    double sum = 0.0;
    for (const auto& [neighbour, conductance] : neighbours) sum += conductance;
    for (auto& [neighbour, share] : neighbours) share /= sum;
    return neighbours;
}

void attach(const PlacedEffect& effect, NetworkBuilder& network) {
    const double growth_per_K = effect.values[0];
    const std::size_t node = network.node_of_source(effect.at);
    network.multiply_source(
        effect.at, [=, shares = housing_of(network.links_of(node), effect.form)](const NetworkState& state) {
            double housing_C = 0.0;
            for (const auto& [neighbour, share] : shares) housing_C += share * state.node_C[neighbour];
            return shares.empty() ? 1.0
                                  : std::max(0.0, 1.0 + growth_per_K * (state.node_C[node] - housing_C));
        });
}

std::vector<EffectParameterDefinition> growth() {
    return {{.name = "growth_per_K", .lower = 0, .upper = 1, .prior_centre = 0.03, .prior_sigma = 0.05}};
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
              .parameters = growth()},
             {.name = "to_first_neighbour",
              .site = EffectSite::source,
              .equation = "the same, T_housing the other end of the first link of the node in the file",
              .parameters = growth()},
             {.name = "to_second_neighbour",
              .site = EffectSite::source,
              .equation = "the same, T_housing the other end of its second link",
              .parameters = growth()}},
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
