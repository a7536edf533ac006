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

/// One row's features side by side.
Eigen::MatrixXd rows_of(const std::vector<std::vector<double>>& features) {
    const auto rank = static_cast<Eigen::Index>(features.size());
    const auto rows = static_cast<Eigen::Index>(features.front().size());
    const auto padded = static_cast<Eigen::Index>(vector_loops::padded(features.size()));
    Eigen::MatrixXd by_row(padded, rows);
    by_row.bottomRows(padded - rank).setZero();
    for (Eigen::Index k = 0; k < rank; ++k) {
        by_row.row(k) =
            Eigen::Map<const Eigen::RowVectorXd>(features[static_cast<std::size_t>(k)].data(), rows);
    }
    return by_row;
}

/// The columns of by_row that belong to these rows of the problem.
std::vector<Eigen::Index> columns_of(const std::vector<std::size_t>& rows, std::size_t stride) {
    std::vector<Eigen::Index> columns;
    columns.reserve(rows.size());
    for (const std::size_t row : rows) columns.push_back(static_cast<Eigen::Index>(row / stride));
    return columns;
}

}  // namespace

KernelFeatures kernel_features(const LagProblem& problem, double sigma, double tolerance,
                               std::size_t stride) {
    const StridedLags lags(problem, stride);
    const std::size_t rows = (problem.rows() + stride - 1) / stride;
    std::vector<double> left_over(rows, 1.0);
    std::vector<std::vector<double>> features;
    std::vector<const double*> columns;
    std::vector<double> pivot_row;
    KernelFeatures kernel;
    kernel.stride = stride;
    while (kernel.pivots.size() < rows) {
        const auto largest = std::ranges::max_element(left_over);
        if (!(*largest > tolerance)) break;
        const std::size_t rank = kernel.pivots.size();
        const auto pivot = static_cast<std::size_t>(largest - left_over.begin());
        pivot_row.resize(rank);
        for (std::size_t k = 0; k < rank; ++k) pivot_row[k] = columns[k][pivot];
        kernel.left_over.push_back(*largest);
        const double diagonal = std::sqrt(*largest);
        std::vector<double>& column = features.emplace_back(rows);
        vector_loops::squared_distances_to(lags.at(), rows, problem.input(pivot * stride).data(),
                                           problem.lags, column.data());
        vector_loops::scaled_exp(column.data(), rows, -1.0 / (sigma * sigma));
        vector_loops::subtract_columns(columns.data(), rows, rank, pivot_row.data(), column.data());
        for (std::size_t i = 0; i < rows; ++i) {
            column[i] /= diagonal;
            left_over[i] -= column[i] * column[i];
        }
        left_over[pivot] = 0.0;
        columns.push_back(column.data());
        kernel.pivots.push_back(pivot * stride);
    }
    kernel.by_row = rows_of(features);
    return kernel;
}

std::size_t KernelFeatures::rank_at(double tolerance) const {
    const auto first_within =
        std::ranges::find_if(left_over, [tolerance](double error) { return error <= tolerance; });
    return static_cast<std::size_t>(first_within - left_over.begin());
}

double feature_tolerance(double sigma) {
    return std::min(1e-7, 2.5e-8 / (sigma * sigma));
}

std::vector<double> pivot_coefficients(const KernelFeatures& kernel, const Eigen::VectorXd& weights) {
    const auto rank = static_cast<Eigen::Index>(kernel.pivots.size());
    const Eigen::MatrixXd upper =
        kernel.by_row.topRows(rank)(Eigen::all, columns_of(kernel.pivots, kernel.stride));
    const Eigen::VectorXd solved = upper.triangularView<Eigen::Upper>().solve(weights.head(rank));
    return {solved.begin(), solved.end()};
}

Eigen::VectorXd weights_of(const KernelFeatures& features, const std::vector<std::size_t>& rows,
                           const std::vector<double>& coefficients) {
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(features.by_row.rows());
    vector_loops::add_rows(features.by_row.data(), static_cast<std::size_t>(weights.size()),
                           columns_of(rows, features.stride), coefficients, weights.data());
    return weights;
}

}  // namespace thermbal
