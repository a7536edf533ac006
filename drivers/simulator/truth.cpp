#include "simulator/truth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

namespace thermbal {
namespace {

constexpr double least_rise_C = 1e-6;
constexpr double longest_warm_up_s = 60.0 * 24.0 * 3600.0;

Eigen::MatrixXd balance_jacobian(const PlantDescription& plant, std::vector<double> node_C, double room_C,
                                 const Drive& drive) {
    const auto n = static_cast<Eigen::Index>(node_C.size());
    constexpr double probe_C = 1e-4;
    Eigen::MatrixXd jacobian(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
        const auto column = static_cast<std::size_t>(j);
        const double at_C = node_C[column];
        node_C[column] = at_C + probe_C;
        const std::vector<double> above = heat_balance_W(plant, node_C, room_C, drive);
        node_C[column] = at_C - probe_C;
        const std::vector<double> below = heat_balance_W(plant, node_C, room_C, drive);
        node_C[column] = at_C;
        for (Eigen::Index i = 0; i < n; ++i) {
            const auto row = static_cast<std::size_t>(i);
            jacobian(i, j) = (above[row] - below[row]) / (2.0 * probe_C);
        }
    }
    return jacobian;
}

struct Crossing {
    double target_C = 0.0;
    double at_s = std::numeric_limits<double>::quiet_NaN();
    bool open = false;
};

std::vector<Crossing> crossings_to_find(const std::vector<double>& settled_C, double room_C) {
    std::vector<Crossing> crossings;
    crossings.reserve(settled_C.size());
    for (const double settled : settled_C) {
        crossings.push_back({.target_C = room_C + 0.95 * (settled - room_C),
                             .open = std::abs(settled - room_C) > least_rise_C});
    }
    return crossings;
}

void follow_warm_up(Plant& plant, double room_C, std::vector<Crossing>& crossings) {
    std::vector<double> before_C = plant.sensor_C();
    const auto any_open = [&] {
        return std::ranges::any_of(crossings, [](const Crossing& c) { return c.open; });
    };
    while (any_open() && plant.time_s() < longest_warm_up_s) {
        const double before_s = plant.time_s();
        plant.advance_to(before_s + Plant::max_step_s);
        const std::vector<double> now_C = plant.sensor_C();
        for (std::size_t k = 0; k < crossings.size(); ++k) {
            Crossing& crossing = crossings[k];
            const double wanted = std::abs(crossing.target_C - room_C);
            if (!crossing.open || std::abs(now_C[k] - room_C) < wanted) continue;
            const double share = (crossing.target_C - before_C[k]) / (now_C[k] - before_C[k]);
            crossing.at_s = before_s + share * (plant.time_s() - before_s);
            crossing.open = false;
        }
        before_C = now_C;
    }
}

}  // namespace

Result<std::vector<double>> steady_state_C(const PlantDescription& plant, double room_C, const Drive& drive) {
    std::vector<double> node_C(plant.nodes.size(), room_C + 1.0);
    const auto n = static_cast<Eigen::Index>(node_C.size());
    for (int iteration = 0; iteration < 100; ++iteration) {
        const std::vector<double> balance = heat_balance_W(plant, node_C, room_C, drive);
        const Eigen::VectorXd residual_W = Eigen::Map<const Eigen::VectorXd>(balance.data(), n);
        const Eigen::VectorXd step_C =
            -balance_jacobian(plant, node_C, room_C, drive).partialPivLu().solve(residual_W);
        const double largest_C = step_C.cwiseAbs().maxCoeff();
        if (!std::isfinite(largest_C)) break;
        // A damped step keeps the first ones out of temperatures where the oil's law has no meaning.
        const double damping = std::min(1.0, 10.0 / std::max(largest_C, 1e-300));
        for (Eigen::Index i = 0; i < n; ++i) node_C[static_cast<std::size_t>(i)] += damping * step_C(i);
        if (largest_C < 1e-10) return node_C;
    }
    return fail(NextStep::stop,
                "plant: no steady state found after 100 Newton steps; check the plant's numbers");
}

Result<Truth> plant_truth(const PlantDescription& description, double room_C, const Drive& drive) {
    const Result<std::vector<double>> settled = steady_state_C(description, room_C, drive);
    if (!settled) return std::unexpected(settled.error());

    std::vector<double> sensor_settled_C;
    sensor_settled_C.reserve(description.sensors.size());
    for (const PlantSensor& sensor : description.sensors) {
        sensor_settled_C.push_back(sensor.node == PlantSensor::room ? room_C : (*settled)[sensor.node]);
    }
    std::vector<Crossing> crossings = crossings_to_find(sensor_settled_C, room_C);
    Plant plant(description, Room{.mean_C = room_C}, drive);
    follow_warm_up(plant, room_C, crossings);

    Truth truth{.node_C = *settled, .channels = {}};
    for (std::size_t k = 0; k < description.sensors.size(); ++k) {
        const PlantSensor& sensor = description.sensors[k];
        truth.channels.push_back(
            {.channel = sensor.channel,
             .node = sensor.node == PlantSensor::room ? "room" : description.nodes[sensor.node].name,
             .steady_state_C = sensor_settled_C[k],
             .equilibrium_time_min = crossings[k].at_s / 60.0});
    }
    return truth;
}

}  // namespace thermbal
