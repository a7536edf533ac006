#include "regression/kernel_features.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "regression/vector_loops.hpp"

namespace thermbal {

namespace {

/// Every stride-th row, lag by lag: lag l of row k * stride is at()[l][k].
class StridedLags {
  public:
    StridedLags(const LagProblem& problem, std::size_t stride) : phases_(stride) {
        for (std::size_t k = 0; k < problem.unit.size(); ++k) phases_[k % stride].push_back(problem.unit[k]);
        for (std::size_t l = 0; l < problem.lags; ++l)
            lagged_.push_back(phases_[l % stride].data() + l / stride);
    }

    const double* const* at() const { return lagged_.data(); }

  private:
    std::vector<std::vector<double>> phases_;
    std::vector<const double*> lagged_;
};

}  // namespace

KernelFeatures kernel_features(const LagProblem& problem, double sigma, double tolerance,
                               std::size_t stride) {
    const StridedLags lags(problem, stride);
    const std::size_t rows = (problem.rows() + stride - 1) / stride;
    std::vector<double> left_over(rows, 1.0);
    std::vector<double> columns;
    std::vector<double> pivot_row;
    KernelFeatures kernel;
    kernel.stride = stride;
    while (kernel.pivots.size() < rows) {
        const auto largest = std::ranges::max_element(left_over);
        if (!(*largest > tolerance)) break;
        const std::size_t rank = kernel.pivots.size();
        const auto pivot = static_cast<std::size_t>(largest - left_over.begin());
        pivot_row.resize(rank);
        for (std::size_t k = 0; k < rank; ++k) pivot_row[k] = columns[k * rows + pivot];
        const double diagonal = std::sqrt(*largest);
        columns.resize((rank + 1) * rows);
        double* column = columns.data() + rank * rows;
        vector_loops::squared_distances_to(lags.at(), rows, problem.input(pivot * stride).data(),
                                           problem.lags, column);
        vector_loops::scaled_exp(column, rows, -1.0 / (sigma * sigma));
        vector_loops::subtract_columns(columns.data(), rows, rank, pivot_row.data(), column);
        for (std::size_t i = 0; i < rows; ++i) {
            column[i] /= diagonal;
            left_over[i] -= column[i] * column[i];
        }
        left_over[pivot] = 0.0;
        kernel.pivots.push_back(pivot * stride);
    }
    kernel.features = Eigen::Map<const Eigen::MatrixXd>(columns.data(), static_cast<Eigen::Index>(rows),
                                                        static_cast<Eigen::Index>(kernel.pivots.size()));
    return kernel;
}

double feature_tolerance(double sigma) {
    return std::min(1e-7, 2.5e-8 / (sigma * sigma));
}

std::vector<double> pivot_coefficients(const KernelFeatures& kernel, const Eigen::VectorXd& weights) {
    std::vector<Eigen::Index> pivots;
    pivots.reserve(kernel.pivots.size());
    for (const std::size_t row : kernel.pivots)
        pivots.push_back(static_cast<Eigen::Index>(row / kernel.stride));
    const Eigen::MatrixXd lower = kernel.features(pivots, Eigen::all);
    const Eigen::VectorXd solved = lower.transpose().triangularView<Eigen::Upper>().solve(weights);
    return {solved.begin(), solved.end()};
}

Eigen::VectorXd weights_of(const KernelFeatures& features, const std::vector<std::size_t>& rows,
                           const std::vector<double>& coefficients) {
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(features.features.cols());
    for (std::size_t k = 0; k < rows.size(); ++k) {
        weights += coefficients[k] *
                   features.features.row(static_cast<Eigen::Index>(rows[k] / features.stride)).transpose();
    }
    return weights;
}

}  // namespace thermbal
