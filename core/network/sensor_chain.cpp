#include "sensor_chain.hpp"

#include <algorithm>
#include <cmath>

#include "phi.hpp"

namespace thermbal {
namespace {

using Eigen::Index;

struct End {
    double value_C;
    double slope_C_per_s;
};

/// tau ds/dt = T - s over a step of h, exactly, for the cubic T that has the right values and slopes at both
/// ends.
double lagged(double before_C, double h_s, double tau_s, const std::array<double, 5>& phi, End from, End to) {
    const double rise = to.value_C - from.value_C;
    const double begin = from.slope_C_per_s * h_s;
    const double end = to.slope_C_per_s * h_s;
    const double squared = 3.0 * rise - 2.0 * begin - end;
    const double cubed = begin + end - 2.0 * rise;
    const double a = h_s / tau_s;
    return phi[0] * before_C +
           a * (from.value_C * phi[1] + begin * phi[2] + 2.0 * squared * phi[3] + 6.0 * cubed * phi[4]);
}

}  // namespace

SensorChain::SensorChain(const CompiledNetwork& network)
    : network_(network), lagged_C_(network.sensors.size(), 0.0), decays_(network.sensors.size()) {
    for (const CompiledSensor& sensor : network.sensors) {
        if (sensor.time_constant_s <= 0.0) continue;
        needs_slopes_ = true;
        const auto node = static_cast<Index>(sensor.node);
        if (sensor.node != ambient_index && std::ranges::find(lagged_nodes_, node) == lagged_nodes_.end())
            lagged_nodes_.push_back(node);
    }
}

double SensorChain::ambient_share(std::size_t sensor, double time_s) const {
    double share = 0.0;
    for (const Detachment& detachment : network_.detachments) {
        if (detachment.sensor != sensor || detachment.from_s > time_s) continue;
        share = detachment.ambient_share;
        if (detachment.time_constant_s > 0.0)
            share *= -std::expm1(-(time_s - detachment.from_s) / detachment.time_constant_s);
    }
    return share;
}

double SensorChain::measured(std::size_t sensor, double share, const Eigen::VectorXd& node_values,
                             double ambient_value) const {
    const std::size_t node = network_.sensors[sensor].node;
    const double own = node == ambient_index ? ambient_value : node_values[static_cast<Index>(node)];
    return own + share * (ambient_value - own);
}

void SensorChain::begin(double time_s, const Eigen::VectorXd& node_C, double ambient_C) {
    for (std::size_t i = 0; i < lagged_C_.size(); ++i) {
        lagged_C_[i] = measured(i, ambient_share(i, time_s), node_C, ambient_C);
    }
}

void SensorChain::advance(const StepEnds& step) {
    if (!needs_slopes_) return;
    const double h_s = step.to_s - step.from_s;
    const double ambient_slope = (step.to_ambient_C - step.from_ambient_C) / h_s;
    for (std::size_t i = 0; i < lagged_C_.size(); ++i) {
        if (network_.sensors[i].time_constant_s <= 0.0) continue;
        const double share = ambient_share(i, 0.5 * (step.from_s + step.to_s));
        const End from{measured(i, share, step.from_C, step.from_ambient_C),
                       measured(i, share, step.from_slope_C_per_s, ambient_slope)};
        const End to{measured(i, share, step.to_C, step.to_ambient_C),
                     measured(i, share, step.to_slope_C_per_s, ambient_slope)};
        const double tau_s = network_.sensors[i].time_constant_s;
        if (decays_[i].h_s != h_s) decays_[i] = {h_s, phi_functions<5>(-h_s / tau_s)};
        lagged_C_[i] = lagged(lagged_C_[i], h_s, tau_s, decays_[i].phi, from, to);
    }
}

double SensorChain::read(std::size_t sensor, double time_s, const Eigen::VectorXd& node_C,
                         double ambient_C) const {
    double reading = network_.sensors[sensor].time_constant_s > 0.0
                         ? lagged_C_[sensor]
                         : measured(sensor, ambient_share(sensor, time_s), node_C, ambient_C);
    for (const ReadingTerm& term : network_.reading_terms) {
        if (term.sensor == sensor) reading += term.added_C(time_s);
    }
    return reading;
}

}  // namespace thermbal
