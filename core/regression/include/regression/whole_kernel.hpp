#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "regression/lags.hpp"

namespace thermbal {

/// The Gaussian kernel of every stride-th row of a problem (column k belongs to row k * stride) with every
/// other, not factorised: where noise makes its rank that of the rows, features only cost.
struct WholeKernel {
    Eigen::MatrixXd by_row;  ///< symmetric; rows of zeros up to a multiple of eight
    std::size_t stride = 1;

    std::size_t rows() const { return static_cast<std::size_t>(by_row.cols()); }
};

WholeKernel whole_kernel(const LagProblem& problem, double sigma, std::size_t stride = 1);

}  // namespace thermbal
