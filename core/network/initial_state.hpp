#pragma once

#include <Eigen/Core>

#include "network/simulate.hpp"
#include "network_builder.hpp"

namespace thermbal {

/// Where every node starts (network/simulate.hpp says the rule). `ambient_C` is the room's at the beginning.
Eigen::VectorXd initial_temperatures(const CompiledNetwork& network, const Model& model, const Inputs& inputs,
                                     double ambient_C);

}  // namespace thermbal
