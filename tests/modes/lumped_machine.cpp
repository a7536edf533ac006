#include "lumped_machine.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Eigenvalues>

namespace thermbal::testing {

namespace {

std::vector<double> rates(const LumpedMachine& machine, const std::vector<double>& temperature,
                          double ambient, double share) {
    std::vector<double> rate(temperature.size());
    for (std::size_t i = 0; i < temperature.size(); ++i) {
        double flow =
            share * machine.power_W[i] * std::exp(-machine.friction_loss_per_K * (temperature[i] - 20.0)) -
            machine.to_air_W_per_K[i] * (temperature[i] - ambient);
        for (std::size_t j = 0; j < temperature.size(); ++j) {
            flow += machine.between_W_per_K[i][j] * (temperature[j] - temperature[i]);
        }
        rate[i] = 60.0 * flow / machine.heat_capacity_J_per_K[i];  // K a minute
    }
    return rate;
}

std::vector<double> moved(const std::vector<double>& from, const std::vector<double>& rate, double minutes) {
    std::vector<double> to = from;
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += minutes * rate[i];
    return to;
}

}  // namespace

std::string channel_name(std::size_t number) {
    std::string name("T");
    name += std::to_string(number);
    return name;
}

LumpedMachine random_machine(std::uint64_t seed) {
    std::mt19937_64 generator(seed);
    const auto about = [&](double value, double spread) {
        return value * std::exp(spread * std::normal_distribution<double>()(generator));
    };
    // front bearing, rear bearing, shaft, sleeve, head front, head rear, motor, column
    const std::vector<double> capacity{2500.0, 1800.0, 7000.0, 16000.0, 40000.0, 45000.0, 12000.0, 160000.0};
    const std::vector<double> air{0.5, 0.4, 1.5, 4.0, 14.0, 15.0, 5.0, 40.0};
    LumpedMachine machine;
    for (std::size_t i = 0; i < capacity.size(); ++i) {
        machine.heat_capacity_J_per_K.push_back(about(capacity[i], 0.3));
        machine.to_air_W_per_K.push_back(about(air[i], 0.3));
    }
    machine.between_W_per_K.assign(capacity.size(), std::vector<double>(capacity.size(), 0.0));
    const auto link = [&](std::size_t a, std::size_t b, double conductance) {
        machine.between_W_per_K[a][b] = machine.between_W_per_K[b][a] = about(conductance, 0.3);
    };
    link(0, 2, 12.0);
    link(1, 2, 10.0);
    link(0, 3, 15.0);
    link(1, 3, 12.0);
    link(3, 4, 18.0);
    link(3, 5, 14.0);
    link(4, 5, 20.0);
    link(5, 6, 5.0);
    link(5, 7, 6.0);
    machine.power_W = {about(90.0, 0.3), about(60.0, 0.3), 0.0, 0.0, 0.0, 0.0, about(60.0, 0.5), 0.0};
    return machine;
}

SimulatedTest simulate(const LumpedMachine& machine, const Conditions& conditions) {
    constexpr double period_min = 0.25;
    constexpr int substeps = 5;
    const auto scans = static_cast<std::size_t>(std::lround(conditions.duration_min / period_min)) + 1;
    const std::size_t lumps = machine.power_W.size();
    SimulatedTest test;
    test.window.scans = scans;
    test.window.channels.resize(lumps + 1);
    for (std::size_t i = 0; i <= lumps; ++i) test.window.channels[i].name = channel_name(i + 1);
    test.clean_C.resize(lumps);
    Column speed{"spindle_rpm", {}};
    std::mt19937_64 generator(conditions.noise_seed);
    std::normal_distribution<double> noise(0.0, conditions.noise_C);
    const auto reading = [&](double value) {
        return std::round((value + noise(generator)) / conditions.rounding_C) * conditions.rounding_C;
    };
    std::vector<double> temperature(lumps, conditions.ambient_C(0.0));
    for (std::size_t k = 0; k < scans; ++k) {
        const double minute = static_cast<double>(k) * period_min;
        test.window.channels[0].values.push_back(reading(conditions.ambient_C(minute)));
        for (std::size_t i = 0; i < lumps; ++i) {
            test.clean_C[i].push_back(temperature[i]);
            test.window.channels[i + 1].values.push_back(reading(temperature[i]));
        }
        speed.values.push_back(5000.0 * conditions.heat_share(minute));
        const double step = period_min / substeps;
        for (int sub = 0; sub < substeps; ++sub) {
            const double at = minute + sub * step;
            const double share = conditions.heat_share(minute);
            const auto rate = [&](const std::vector<double>& state, double when) {
                return rates(machine, state, conditions.ambient_C(when), share);
            };
            const auto k1 = rate(temperature, at);
            const auto k2 = rate(moved(temperature, k1, 0.5 * step), at + 0.5 * step);
            const auto k3 = rate(moved(temperature, k2, 0.5 * step), at + 0.5 * step);
            const auto k4 = rate(moved(temperature, k3, step), at + step);
            for (std::size_t i = 0; i < lumps; ++i) {
                temperature[i] += step / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
    }
    if (conditions.log_speed) test.window.inputs.push_back(std::move(speed));
    return test;
}

std::vector<double> settled_C(const LumpedMachine& machine, double ambient_C, double heat_share) {
    const auto lumps = static_cast<Eigen::Index>(machine.power_W.size());
    std::vector<double> temperature(machine.power_W.size(), ambient_C);
    for (int iteration = 0; iteration < 200; ++iteration) {
        Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(lumps, lumps);
        Eigen::VectorXd flow(lumps);
        for (Eigen::Index i = 0; i < lumps; ++i) {
            const auto index = static_cast<std::size_t>(i);
            matrix(i, i) += machine.to_air_W_per_K[index];
            flow[i] = machine.to_air_W_per_K[index] * ambient_C +
                      heat_share * machine.power_W[index] *
                          std::exp(-machine.friction_loss_per_K * (temperature[index] - 20.0));
            for (Eigen::Index j = 0; j < lumps; ++j) {
                const double conductance = machine.between_W_per_K[index][static_cast<std::size_t>(j)];
                matrix(i, i) += conductance;
                matrix(i, j) -= conductance;
            }
        }
        const Eigen::VectorXd solved = matrix.partialPivLu().solve(flow);
        for (Eigen::Index i = 0; i < lumps; ++i) {
            double& value = temperature[static_cast<std::size_t>(i)];
            value = 0.5 * (value + solved[i]);
        }
    }
    return temperature;
}

std::vector<double> time_constants_min(const LumpedMachine& machine) {
    const auto lumps = static_cast<Eigen::Index>(machine.power_W.size());
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(lumps, lumps);
    for (Eigen::Index i = 0; i < lumps; ++i) {
        const auto row = static_cast<std::size_t>(i);
        matrix(i, i) += machine.to_air_W_per_K[row];
        for (Eigen::Index j = 0; j < lumps; ++j) {
            matrix(i, i) += machine.between_W_per_K[row][static_cast<std::size_t>(j)];
            matrix(i, j) -= machine.between_W_per_K[row][static_cast<std::size_t>(j)];
        }
        matrix.row(i) *= 60.0 / machine.heat_capacity_J_per_K[row];
    }
    std::vector<double> constants;
    for (const std::complex<double>& value : matrix.eigenvalues()) constants.push_back(1.0 / value.real());
    std::sort(constants.begin(), constants.end());
    return constants;
}

}  // namespace thermbal::testing
