#include "initial_state.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace thermbal {
namespace {

using Eigen::Index;

/// The mean of the first readings on each node, NaN where there is none. A sensor that reads a constant too
/// much does so from its first reading on: what the effect adds is taken off again.
Eigen::VectorXd first_node_readings(const CompiledNetwork& network, const Model& model,
                                    const Inputs& inputs) {
    const auto count = static_cast<Index>(network.node_names.size());
    const double start_s = inputs.time_s.empty() ? 0.0 : inputs.time_s.front();
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(count);
    Eigen::VectorXd readings = Eigen::VectorXd::Zero(count);
    for (std::size_t i = 0; i < model.sensors.size(); ++i) {
        if (network.sensors[i].node == ambient_index) continue;
        const auto first = std::ranges::find(inputs.first_readings, model.sensors[i].channel,
                                             &Inputs::FirstReading::channel);
        if (first == inputs.first_readings.end() || !std::isfinite(first->value_C)) continue;
        double value_C = first->value_C;
        for (const ReadingTerm& term : network.reading_terms) {
            if (term.sensor == i) value_C -= term.added_C(start_s);
        }
        sum[static_cast<Index>(network.sensors[i].node)] += value_C;
        readings[static_cast<Index>(network.sensors[i].node)] += 1.0;
    }
    return (readings.array() > 0.0).select(sum.array() / readings.array(), std::nan(""));
}

}  // namespace

Eigen::VectorXd initial_temperatures(const CompiledNetwork& network, const Model& model, const Inputs& inputs,
                                     double ambient_C) {
    Eigen::VectorXd known_C = first_node_readings(network, model, inputs);
    const Index count = known_C.size();
    if (known_C.array().isFinite().all()) return known_C;
    // T_i = mean of its neighbours, unknown ones included, in differences to the ambient; a pull to it that
    // is too weak to matter decides where no link leads to a reading.
    constexpr double pull = 1e-12;
    Eigen::MatrixXd equations = Eigen::MatrixXd::Identity(count, count) * pull;
    for (const CompiledLink& link : network.links) {
        const auto a = static_cast<Index>(link.a);
        const auto b = static_cast<Index>(link.b);
        equations(a, a) += 1.0;
        equations(b, b) += 1.0;
        equations(a, b) -= 1.0;
        equations(b, a) -= 1.0;
    }
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    for (Index i = 0; i < count; ++i) {
        if (!std::isfinite(known_C[i])) continue;
        equations.row(i).setZero();
        equations(i, i) = 1.0;
        right[i] = known_C[i] - ambient_C;
    }
    return equations.partialPivLu().solve(right).array() + ambient_C;
}

}  // namespace thermbal
