#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "series/recorded_test.hpp"

namespace thermbal::testing {

/// A spindle head of a few lumps, integrated by classical Runge-Kutta: independent of anything in core/modes.
struct LumpedMachine {
    std::vector<double> heat_capacity_J_per_K;
    std::vector<double> to_air_W_per_K;
    std::vector<std::vector<double>> between_W_per_K;
    std::vector<double> power_W;
    double friction_loss_per_K =
        0.0;  ///< friction heat falls as exp(-this * (T - 20)) with its own node's temperature
};

std::string channel_name(std::size_t number);  ///< T1, T2, ...

LumpedMachine random_machine(std::uint64_t seed);

struct Conditions {
    double duration_min = 200.0;
    std::function<double(double minute)> ambient_C = [](double) { return 20.0; };
    std::function<double(double minute)> heat_share = [](double) { return 1.0; };
    double noise_C = 0.05;
    double rounding_C = 0.01;
    std::uint64_t noise_seed = 1;
    bool log_speed = true;
};

struct SimulatedTest {
    TestWindow window;                         ///< T1 the ambient, T2 ... the lumps, spindle_rpm if logged
    std::vector<std::vector<double>> clean_C;  ///< per lump, one a scan
};

SimulatedTest simulate(const LumpedMachine& machine, const Conditions& conditions);

/// Where every lump settles at this ambient and heat.
std::vector<double> settled_C(const LumpedMachine& machine, double ambient_C, double heat_share);

/// Time constants of the linear machine, fastest first (from the eigenvalues, so not for nonlinear friction).
std::vector<double> time_constants_min(const LumpedMachine& machine);

}  // namespace thermbal::testing
