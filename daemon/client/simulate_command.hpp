#pragma once

#include <optional>
#include <string>

namespace thermbal {

struct SimulateCommand {
    std::string model;
    std::string inputs;  ///< recorded test; empty: nothing drives the model but its constant sources
    std::optional<double> duration_min;
    double every_s = 15.0;  ///< between samples where the inputs hold no readings
    std::string csv;
    bool nodes = false;  ///< the nodes' temperatures, too
};

/// `thermbalctl simulate`: what the model's sensors would read, as a recorded test. Returns the exit status.
int run_simulate(const SimulateCommand& command);

}  // namespace thermbal
