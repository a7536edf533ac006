#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/error.hpp"
#include "network/model.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// What drives a simulation. A column holds each value until its next row, and over a NaN; before the first
/// finite value it has that one. The simulation begins at time_s.front() (0 without rows).
struct Inputs {
    std::vector<double> time_s;   ///< strictly increasing
    std::vector<Column> columns;  ///< inputs and channels, each of the length of time_s
    struct FirstReading {
        std::string channel;
        double value_C;
    };
    std::vector<FirstReading> first_readings;
    /// When a thermostat was seen to switch, on first: its chiller runs then, whatever the temperatures.
    struct SeenSwitchings {
        std::string node;
        std::vector<double> moments_s;
    };
    std::vector<SeenSwitchings> seen_switchings = {};  ///< of nodes that are not here: by their temperature
};

/// The inputs of a recorded test: all its columns, and for each channel its first good reading of the first
/// `within_s` seconds.
Inputs inputs_of(const RecordedTest& test, double within_s = 300.0);

struct SimulationOptions {
    double max_step_s = 60.0;
    /// Of one step, where something depends on temperature or smoothly on time: the difference between the
    /// third-order step that is taken and a second-order one. What is linear between switchings is exact
    /// whatever it says.
    double tolerance_C = 1e-3;
};

/// A thermostat begins or ends to take heat away.
struct ThermostatSwitching {
    double time_s = 0.0;
    std::size_t node = 0;  ///< column of Simulation::node_C
    bool on = false;
};

struct Simulation {
    std::vector<std::string> node_names;          ///< the model's nodes, then those that effects added
    Eigen::MatrixXd node_C;                       ///< rows: sample times; columns: node_names
    Eigen::MatrixXd reading_C;                    ///< rows: sample times; columns: the model's sensors
    Eigen::VectorXd ambient_C;                    ///< the room as the model has it, at the sample times
    std::vector<ThermostatSwitching> switchings;  ///< in the order of time
    int steps = 0;
};

/// The temperatures at `sample_times_s` (increasing, none before the inputs begin). Every node starts at the
/// mean of the first readings on it (less what a sensor effect adds), one without a reading at the mean of
/// those its links reach, and at the ambient when no reading can be reached. Pure: same arguments, same bits;
/// any thread. Errors: refuse_input for a model that is not valid or a column that is missing; stop when the
/// temperatures run away.
Result<Simulation> simulate(const Model& model, const Inputs& inputs, std::span<const double> sample_times_s,
                            const SimulationOptions& options = {});

}  // namespace thermbal
