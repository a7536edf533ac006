#pragma once

#include <vector>

#include "base/error.hpp"
#include "regression/lags.hpp"
#include "regression/svr.hpp"
#include "regression/sweep.hpp"

namespace thermbal {

/// A point of the grid with its cross-validated error.
struct GridChoice {
    double C = 0.0;
    double sigma = 0.0;
    double cv_mse_unit = 0.0;  ///< mean over folds of the held-out mean squared error, on the [0, 1] scale
};

/// The grid point with the smallest cross-validated error (the first of equals: sigma by sigma, C within), by
/// options.solver.
Result<GridChoice> search_grid(const LagProblem& problem, const SweepOptions& options,
                               const Cancelled& cancelled);

/// The fit of all rows at one point, by options.solver.
Result<SvrModel> fit_model(const LagProblem& problem, double C, double sigma, const SweepOptions& options);

/// The error of every grid point, sigma by sigma, C within, all of them computed: what search_grid chooses
/// from.
Result<std::vector<double>> cross_validate_grid(const LagProblem& problem, const SweepOptions& options,
                                                const Cancelled& cancelled);

}  // namespace thermbal
