#include "simulator/plant.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "simulator/integrate.hpp"

namespace thermbal {
namespace {

constexpr double stefan_boltzmann_W_per_m2K4 = 5.670374419e-8;
constexpr double zero_celsius_K = 273.15;
/// Below this product of viscosity and speed the viscous torque no longer falls (Palmgren).
constexpr double least_viscous_product = 2000.0;

double fourth_power(double x) {
    return x * x * x * x;
}

}  // namespace

double Room::at(double time_s) const {
    if (time_s <= 0.0) return mean_C;
    return mean_C + drift_C_per_h * time_s / 3600.0 +
           cycle_amplitude_C * std::sin(2.0 * std::numbers::pi * time_s / cycle_period_s);
}

double oil_viscosity_mm2_per_s(const PlantDescription& plant, double temperature_C) {
    const double exponent = plant.walther_a - plant.walther_b * std::log10(temperature_C + zero_celsius_K);
    return std::pow(10.0, std::pow(10.0, exponent)) - 0.7;
}

double friction_W(const PlantDescription& plant, const PlantBearing& bearing, double temperature_C,
                  double rpm) {
    if (rpm <= 0.0) return 0.0;
    const double product =
        std::max(oil_viscosity_mm2_per_s(plant, temperature_C) * rpm, least_viscous_product);
    const double viscous_Nm =
        1e-10 * bearing.f0 * std::cbrt(product * product) * std::pow(bearing.mean_diameter_mm, 3);
    const double rad_per_s = rpm * 2.0 * std::numbers::pi / 60.0;
    return rad_per_s * (viscous_Nm + bearing.load_torque_Nm);
}

std::vector<double> heat_sources_W(const PlantDescription& plant, const std::vector<double>& node_C,
                                   const Drive& drive) {
    std::vector<double> heat_W(plant.nodes.size(), 0.0);
    if (drive.spindle_rpm <= 0.0) return heat_W;
    for (const PlantBearing& bearing : plant.bearings) {
        heat_W[bearing.node] += friction_W(plant, bearing, node_C[bearing.node], drive.spindle_rpm);
    }
    for (const PlantHeat& heat : plant.running_heat) heat_W[heat.node] += heat.power_W;
    if (drive.cutting) {
        for (const PlantHeat& heat : plant.cutting_heat) heat_W[heat.node] += heat.power_W;
    }
    return heat_W;
}

std::vector<double> heat_losses_W(const PlantDescription& plant, const std::vector<double>& node_C,
                                  double room_C, const Drive& drive) {
    const double relative_speed = drive.spindle_rpm / plant.reference_rpm;
    const double airflow = std::cbrt(relative_speed * relative_speed);
    const double room_K4 = fourth_power(room_C + zero_celsius_K);
    std::vector<double> loss_W(plant.nodes.size(), 0.0);
    for (std::size_t i = 0; i < loss_W.size(); ++i) {
        const PlantNode& node = plant.nodes[i];
        const double difference_C = node_C[i] - room_C;
        const double film_W_per_m2K =
            node.natural_W_per_m2K125 * std::sqrt(std::sqrt(std::abs(difference_C))) +
            node.forced_W_per_m2K * airflow + node.blower_W_per_m2K;
        const double radiated_W_per_m2 = node.emissivity * stefan_boltzmann_W_per_m2K4 *
                                         (fourth_power(node_C[i] + zero_celsius_K) - room_K4);
        loss_W[i] = node.area_m2 * (film_W_per_m2K * difference_C + radiated_W_per_m2);
    }
    return loss_W;
}

std::vector<double> heat_balance_W(const PlantDescription& plant, const std::vector<double>& node_C,
                                   double room_C, const Drive& drive) {
    std::vector<double> balance_W = heat_sources_W(plant, node_C, drive);
    const std::vector<double> loss_W = heat_losses_W(plant, node_C, room_C, drive);
    for (std::size_t i = 0; i < balance_W.size(); ++i) balance_W[i] -= loss_W[i];
    for (const PlantLink& link : plant.links) {
        const double flow_W = link.conductance_W_per_K * (node_C[link.a] - node_C[link.b]);
        balance_W[link.a] -= flow_W;
        balance_W[link.b] += flow_W;
    }
    return balance_W;
}

Plant::Plant(PlantDescription description, Room room, Drive drive)
    : description_(std::move(description)),
      room_(room),
      drive_(drive),
      state_(description_.nodes.size() + description_.sensors.size(), room.at(0.0)) {}

std::vector<double> Plant::derivative(double time_s, const std::vector<double>& state) const {
    const double room_C = room_.at(time_s);
    const std::size_t nodes = description_.nodes.size();
    std::vector<double> rate = heat_balance_W(description_, state, room_C, drive_);
    for (std::size_t i = 0; i < nodes; ++i) rate[i] /= description_.nodes[i].heat_capacity_J_per_K;
    rate.resize(state.size());
    for (std::size_t k = 0; k < description_.sensors.size(); ++k) {
        const PlantSensor& sensor = description_.sensors[k];
        const double felt_C = sensor.node == PlantSensor::room ? room_C : state[sensor.node];
        rate[nodes + k] = (felt_C - state[nodes + k]) / sensor.lag_s;
    }
    return rate;
}

void Plant::advance_to(double time_s) {
    const auto slope = [this](double t, const std::vector<double>& y) { return derivative(t, y); };
    while (time_s_ < time_s) {
        const double step_s = std::min(max_step_s, time_s - time_s_);
        runge_kutta_step(slope, time_s_, step_s, state_);
        time_s_ = step_s < max_step_s ? time_s : time_s_ + step_s;
    }
}

std::vector<double> Plant::node_C() const {
    return {state_.begin(), state_.begin() + static_cast<std::ptrdiff_t>(description_.nodes.size())};
}

std::vector<double> Plant::sensor_C() const {
    return {state_.begin() + static_cast<std::ptrdiff_t>(description_.nodes.size()), state_.end()};
}

}  // namespace thermbal
