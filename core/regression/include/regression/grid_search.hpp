#pragma once

#include <vector>

#include "base/error.hpp"
#include "regression/lags.hpp"
#include "regression/sweep.hpp"

namespace thermbal {

/// A point of the grid with its cross-validated error, and the fit of all rows at it.
struct GridChoice {
    double C = 0.0;
    double sigma = 0.0;
    double cv_mse_unit = 0.0;  ///< mean over folds of the held-out mean squared error, on the [0, 1] scale
    SvrFit fit;
};

/// The mean over folds of the held-out mean squared error of every grid point, sigma by sigma, C within; by
/// libsvm.
Result<std::vector<double>> cross_validate_by_libsvm(const LagProblem& problem, const SweepOptions& options,
                                                     const Cancelled& cancelled);

/// The grid point with the smallest cross-validated error (the first of equals), refitted on all rows.
Result<GridChoice> search_grid(const LagProblem& problem, const SweepOptions& options,
                               const Cancelled& cancelled);

/// The fit of all rows at one point.
Result<SvrFit> fit_all_rows(const LagProblem& problem, double C, double sigma, const SweepOptions& options);

}  // namespace thermbal
