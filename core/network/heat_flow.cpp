#include "heat_flow.hpp"

#include <algorithm>
#include <cmath>

namespace thermbal {

using Eigen::Index;

namespace {

/// Backwards is as warm as forwards.
double power_share(const CompiledSource& source, double value) {
    const double share = std::abs(value / source.reference);
    return source.exponent == 1.0 ? share : std::pow(share, source.exponent);
}

}  // namespace

HeatFlow::HeatFlow(const CompiledNetwork& network, InputSchedule& schedule)
    : network_(network),
      schedule_(schedule),
      drive_(network.sources.size(), 1.0),
      powered_(network.sources.size()),
      thermostat_on_(network.thermostats.size(), 0) {}

void HeatFlow::begin_step(double from_s, double to_s) {
    step_middle_s_ = 0.5 * (from_s + to_s);
    const bool stopped = std::ranges::any_of(network_.stops_s, [this](const std::pair<double, double>& stop) {
        return stop.first <= step_middle_s_ && step_middle_s_ < stop.second;
    });
    for (std::size_t i = 0; i < drive_.size(); ++i) {
        const CompiledSource& source = network_.sources[i];
        drive_[i] = stopped ? 0.0 : 1.0;
        if (stopped || source.column == no_column) continue;
        const double value = schedule_.at(source.column, step_middle_s_);
        if (value != powered_[i].value) powered_[i] = {value, power_share(source, value)};
        drive_[i] = powered_[i].share;
    }
    room_C_ = network_.ambient_column == no_column ? network_.ambient_C
                                                   : schedule_.at(network_.ambient_column, step_middle_s_);
    if (network_.followed_column != no_column) {
        room_C_ +=
            network_.followed_share * (schedule_.at(network_.followed_column, step_middle_s_) - room_C_);
    }
}

double HeatFlow::ambient_C(double time_s) const {
    if (network_.ambient_shifts.empty()) return room_C_;
    NetworkState state{.time_s = time_s, .step_middle_s = step_middle_s_, .ambient_C = room_C_};
    double shifted = room_C_;
    for (const StateFunction& added_C : network_.ambient_shifts) shifted += added_C(state);
    return shifted;
}

void HeatFlow::evaluate(double time_s, const Eigen::VectorXd& node_C, const Eigen::VectorXd& surface_W_per_K,
                        Eigen::VectorXd& heat_W) const {
    const double air_C = ambient_C(time_s);
    const NetworkState state{.time_s = time_s,
                             .step_middle_s = step_middle_s_,
                             .node_C = node_C.data(),
                             .ambient_C = air_C,
                             .source_drive = drive_.data()};
    add_surfaces(air_C, node_C, surface_W_per_K, heat_W);
    add_sources(state, heat_W);
    for (const HeatTerm& term : network_.heat_terms)
        heat_W[static_cast<Index>(term.node)] += term.power_W(state);
    for (std::size_t i = 0; i < network_.thermostats.size(); ++i) {
        const Thermostat& thermostat = network_.thermostats[i];
        if (thermostat_on_[i] != 0) heat_W[static_cast<Index>(thermostat.node)] -= thermostat.power_W;
    }
}

void HeatFlow::add_surfaces(double ambient_C, const Eigen::VectorXd& node_C,
                            const Eigen::VectorXd& surface_W_per_K, Eigen::VectorXd& heat_W) const {
    heat_W = surface_W_per_K * ambient_C;
    for (const auto& factor : network_.surface_factors) {
        for (Index i = 0; i < heat_W.size(); ++i) {
            if (surface_W_per_K[i] == 0.0) continue;
            const double difference = ambient_C - node_C[i];
            heat_W[i] += surface_W_per_K[i] * difference * (factor(std::abs(difference)) - 1.0);
        }
    }
}

void HeatFlow::add_sources(const NetworkState& state, Eigen::VectorXd& heat_W) const {
    for (std::size_t i = 0; i < network_.sources.size(); ++i) {
        double power = network_.sources[i].power_W * drive_[i];
        for (const SourceFactor& factor : network_.source_factors) {
            if (factor.source == i) power *= factor.factor(state);
        }
        heat_W[static_cast<Index>(network_.sources[i].node)] += power;
    }
}

}  // namespace thermbal
