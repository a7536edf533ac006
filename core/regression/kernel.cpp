#include "regression/kernel.hpp"

namespace thermbal {

Eigen::MatrixXd squared_distances(const LagProblem& problem) {
    const auto rows = static_cast<Eigen::Index>(problem.rows());
    const auto lags = static_cast<Eigen::Index>(problem.lags);
    const Eigen::Map<const Eigen::ArrayXd> series(problem.unit.data(),
                                                  static_cast<Eigen::Index>(problem.unit.size()));
    Eigen::MatrixXd distance(rows, rows);
    distance.diagonal().setZero();
    Eigen::ArrayXd sums(series.size() + 1);
    for (Eigen::Index apart = 1; apart < rows; ++apart) {
        sums(0) = 0.0;
        const Eigen::Index steps = series.size() - apart;
        for (Eigen::Index k = 0; k < steps; ++k) {
            const double difference = series(k + apart) - series(k);
            sums(k + 1) = sums(k) + difference * difference;
        }
        for (Eigen::Index row = 0; row + apart < rows; ++row) {
            const double value = sums(row + lags) - sums(row);
            distance(row + apart, row) = value;
            distance(row, row + apart) = value;
        }
    }
    return distance;
}

Eigen::MatrixXd gaussian_kernel(const Eigen::MatrixXd& squared_distance, double sigma) {
    return (squared_distance.array() * (-1.0 / (sigma * sigma))).exp().matrix();
}

}  // namespace thermbal
