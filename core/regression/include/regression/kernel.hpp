#pragma once

#include <cstddef>
#include <span>

#include <Eigen/Core>

#include "regression/lags.hpp"

namespace thermbal {

/// Squared distances |x_i - x_j|^2 of all rows; rows x rows, symmetric. O(rows^2) whatever the number of
/// lags: along a diagonal, the distance is a sliding sum.
Eigen::MatrixXd squared_distances(const LagProblem& problem);

/// exp(-d / sigma^2): the paper's Gaussian kernel, 1 / sigma^2 is scikit-learn's and libsvm's gamma.
Eigen::MatrixXd gaussian_kernel(const Eigen::MatrixXd& squared_distance, double sigma);

}  // namespace thermbal
