#pragma once

#include <vector>

#include "regression/grid_search.hpp"

namespace thermbal {

/// The grid search on low-rank kernels. A grid point whose error on the folds done so far is already above
/// the best total is left: every fold only adds to it.
Result<GridChoice> search_grid_low_rank(const LagProblem& problem, const SweepOptions& options,
                                        const Cancelled& cancelled);
Result<std::vector<double>> cross_validate_low_rank(const LagProblem& problem, const SweepOptions& options,
                                                    const Cancelled& cancelled);
Result<SvrModel> fit_model_low_rank(const LagProblem& problem, double C, double sigma,
                                    const SweepOptions& options);

}  // namespace thermbal
