#pragma once

#include <random>
#include <string>
#include <vector>

#include "modbus/link.hpp"
#include "simulator/faults.hpp"

namespace thermbal::soak {

/// One row of the study: a fault, with its value and target drawn anew for every injection.
struct FaultDraw {
    std::string name;
    FaultKind kind;
    std::vector<double> values = {};  ///< drawn from these; empty: none
    double timeouts_from = 0.0;       ///< with timeouts_to: a delay of so many response timeouts
    double timeouts_to = 0.0;
    double fewest = 0.0;  ///< with most: a whole number between
    double most = 0.0;
    bool drops_connections = false;  ///< needs a hang-up besides to be noticed
    std::size_t units = 2;           ///< on the line: one of them in two of three draws

    Fault draw(std::mt19937_64& random, double response_timeout_s) const;
};

/// Every fault of the catalogue that the transport knows; exceptions one by one.
std::vector<FaultDraw> fault_draws(Transport transport, std::size_t units);

}  // namespace thermbal::soak
