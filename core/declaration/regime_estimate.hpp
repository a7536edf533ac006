#pragma once

#include <vector>

#include "declaration/live_flow.hpp"

namespace thermbal {

/// The shared time constants of one regime, with what earlier tests of the machine say where options.prior is
/// set. Arguments and errors: estimate_spectrum's.
Result<ArchivedEstimate> estimate_regime(const TestWindow& regime, const std::vector<double>& start_level_C,
                                         const FlowOptions& options);

}  // namespace thermbal
