#pragma once

#include <vector>

#include "regression/folds.hpp"
#include "regression/lags.hpp"

namespace thermbal {

/// Root mean squared error, fold by fold, of the linear one-step predictor fitted to the held-out rows
/// themselves by least squares: no linear predictor does better there, wherever it was fitted. 0 where
/// rounding hides it.
std::vector<double> linear_floor(const LagProblem& problem, const std::vector<Fold>& folds);

/// The same over all rows at once.
double linear_rmse(const LagProblem& problem);

}  // namespace thermbal
