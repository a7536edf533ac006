#include "threshold_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/QR>

namespace thermbal {
namespace {

using Eigen::Index;

std::size_t index_of(const Simulation& simulation, const std::string& node) {
    return static_cast<std::size_t>(std::ranges::find(simulation.node_names, node) -
                                    simulation.node_names.begin());
}

/// The first number of an effect among a fit's.
Index first_of(const std::vector<Parameter>& parameters, std::size_t effect) {
    return std::ranges::find_if(parameters,
                                [&](const Parameter& parameter) {
                                    return parameter.of_effect && parameter.effect == effect;
                                }) -
           parameters.begin();
}

}  // namespace

std::vector<double> moments_at(const Simulation& simulation, const std::string& node) {
    std::vector<double> moments_s;
    for (const ThermostatSwitching& one : simulation.switchings) {
        if (one.node == index_of(simulation, node)) moments_s.push_back(one.time_s);
    }
    return moments_s;
}

Eigen::VectorXd node_course(const Model& model, const Observation& seen, const std::string& node) {
    const auto simulation = simulate(model, seen.inputs, seen.time_s);
    if (!simulation) return {};
    return simulation->node_C.col(static_cast<Index>(index_of(*simulation, node)));
}

std::array<double, 2> thresholds_C(const Eigen::VectorXd& node_C, const std::vector<double>& time_s,
                                   const std::vector<double>& moments_s) {
    std::array<double, 2> sum_C{}, count{};
    for (std::size_t k = 0; k < moments_s.size(); ++k) {
        const auto row = std::min<Index>(std::ranges::lower_bound(time_s, moments_s[k]) - time_s.begin(),
                                         node_C.size() - 1);
        sum_C[k % 2] += node_C(row);
        count[k % 2] += 1.0;
    }
    return {sum_C[0] / count[0], sum_C[1] / count[1]};
}

ThresholdFit::ThresholdFit(const FitProblem& problem, std::size_t effect,
                           const std::vector<double>& moments_s)
    : problem_(problem),
      moments_s_(moments_s),
      node_(problem.model_at(problem.prior_coordinates()).effects[effect].at),
      on_(first_of(problem.parameters(), effect) + 1) {}

Eigen::VectorXd ThresholdFit::placed(Eigen::VectorXd coordinates, double on_C, double hysteresis_C) const {
    const auto& parameters = problem_.parameters();
    const auto put = [&](Index at, double value) {
        coordinates(at) = parameters[static_cast<std::size_t>(at)].to_coordinate(value);
    };
    put(on_, on_C);
    put(on_ + 1, hysteresis_C);
    return coordinates;
}

Eigen::VectorXd ThresholdFit::aligned(Eigen::VectorXd coordinates) const {
    for (std::size_t count = 3;; count *= 2) {
        count = std::min(count, moments_s_.size());
        for (int round = 0; round < 4; ++round) {
            auto next = stepped(coordinates, count);
            if (!next) break;
            coordinates = std::move(*next);
        }
        if (count == moments_s_.size()) return coordinates;
    }
}

std::optional<Eigen::VectorXd> ThresholdFit::late_s(const Eigen::VectorXd& coordinates,
                                                    std::size_t count) const {
    const auto simulation = simulate(problem_.model_at(coordinates), problem_.inputs_at(coordinates),
                                     problem_.data().seen.time_s);
    if (!simulation) return std::nullopt;
    const std::vector<double> switched_s = moments_at(*simulation, node_);
    if (switched_s.size() < count) return std::nullopt;
    Eigen::VectorXd late(static_cast<Index>(count));
    for (std::size_t k = 0; k < count; ++k) late(static_cast<Index>(k)) = switched_s[k] - moments_s_[k];
    return late;
}

std::optional<Eigen::VectorXd> ThresholdFit::stepped(const Eigen::VectorXd& coordinates,
                                                     std::size_t count) const {
    const auto late = late_s(coordinates, count);
    if (!late) return std::nullopt;
    const auto& hysteresis = problem_.parameters()[static_cast<std::size_t>(on_ + 1)];
    const double probe_C = 0.01 * hysteresis.to_value(coordinates(on_ + 1));
    Eigen::MatrixXd slope(late->size(), 2);
    for (const Index k : {Index{0}, Index{1}}) {
        Eigen::VectorXd moved = coordinates;
        const double probe = k == 0 ? probe_C : 0.01;  // the hysteresis is on a logarithm
        moved(on_ + k) += probe;
        const auto then = late_s(moved, count);
        if (!then) return std::nullopt;
        slope.col(k) = (*then - *late) / probe;
    }
    const Eigen::Vector2d wanted = -slope.colPivHouseholderQr().solve(*late);
    const double longest = std::max(std::abs(wanted(0)) / (30.0 * probe_C), std::abs(wanted(1)) / 0.3);
    for (double share = 1.0 / std::max(longest, 1.0); share > 0.05; share *= 0.5) {
        Eigen::VectorXd moved = coordinates;
        moved.segment(on_, 2) += share * wanted;
        const auto then = late_s(moved, count);
        if (then && then->squaredNorm() < late->squaredNorm()) return moved;
    }
    return std::nullopt;
}

}  // namespace thermbal
