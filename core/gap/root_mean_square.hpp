#pragma once

#include <cmath>

#include <Eigen/Core>

namespace thermbal {

/// Over the finite entries; 0 when there is none.
template <typename Derived>
double root_mean_square(const Eigen::MatrixBase<Derived>& values) {
    double sum = 0.0;
    int count = 0;
    for (Eigen::Index column = 0; column < values.cols(); ++column) {
        for (Eigen::Index row = 0; row < values.rows(); ++row) {
            const double value = values(row, column);
            if (!std::isfinite(value)) continue;
            sum += value * value;
            ++count;
        }
    }
    return count == 0 ? 0.0 : std::sqrt(sum / count);
}

}  // namespace thermbal
