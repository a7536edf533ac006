#pragma once

#include <vector>

#include "regression/grid_search.hpp"

namespace thermbal {

/// The reference: every grid point and fold by libsvm.
Result<std::vector<double>> cross_validate_by_libsvm(const LagProblem& problem, const SweepOptions& options,
                                                     const Cancelled& cancelled);
Result<SvrModel> fit_model_by_libsvm(const LagProblem& problem, double C, double sigma,
                                     const SweepOptions& options);

}  // namespace thermbal
