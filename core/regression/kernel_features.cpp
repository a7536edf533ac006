#include "regression/kernel_features.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "regression/vector_loops.hpp"

namespace thermbal {

namespace {

/// One row's features side by side, the first `count` of them.
Eigen::MatrixXd rows_of(const std::vector<std::vector<double>>& features, std::size_t count) {
    const auto rank = static_cast<Eigen::Index>(count);
    const auto rows = static_cast<Eigen::Index>(features.front().size());
    const auto padded = static_cast<Eigen::Index>(vector_loops::padded(count));
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

KernelFactorisation::KernelFactorisation(const LagProblem& problem, double sigma, std::size_t stride)
    : problem_(&problem),
      sigma_(sigma),
      stride_(stride),
      rows_((problem.rows() + stride - 1) / stride),
      phases_(stride),
      left_over_(rows_, 1.0) {
    for (std::size_t k = 0; k < problem.unit.size(); ++k) phases_[k % stride].push_back(problem.unit[k]);
    for (std::size_t l = 0; l < problem.lags; ++l) {
        lagged_.push_back(phases_[l % stride].data() + l / stride);
    }
}

void KernelFactorisation::extend_to(double tolerance, std::size_t most_features) {
    while (pivots_.size() < most_features) {
        const auto largest = std::ranges::max_element(left_over_);
        if (!(*largest > tolerance)) break;
        add_pivot(static_cast<std::size_t>(largest - left_over_.begin()));
    }
}

void KernelFactorisation::add_pivot(std::size_t pivot) {
    const std::size_t rank = pivots_.size();
    std::vector<double> pivot_row(rank);
    for (std::size_t k = 0; k < rank; ++k) pivot_row[k] = features_[k][pivot];
    largest_left_over_.push_back(left_over_[pivot]);
    const double diagonal = std::sqrt(left_over_[pivot]);
    std::vector<double>& column = features_.emplace_back(rows_);
    vector_loops::squared_distances_to(lagged_.data(), rows_, problem_->input(pivot * stride_).data(),
                                       problem_->lags, column.data());
    vector_loops::scaled_exp(column.data(), rows_, -1.0 / (sigma_ * sigma_));
    vector_loops::subtract_columns(columns_.data(), rows_, rank, pivot_row.data(), column.data());
    for (std::size_t i = 0; i < rows_; ++i) {
        column[i] /= diagonal;
        left_over_[i] -= column[i] * column[i];
    }
    left_over_[pivot] = 0.0;
    columns_.push_back(column.data());
    pivots_.push_back(pivot * stride_);
}

KernelFeatures KernelFactorisation::features(double tolerance) {
    extend_to(tolerance, rows_);
    const auto beyond =
        std::ranges::find_if(largest_left_over_, [tolerance](double error) { return error <= tolerance; });
    const auto rank = beyond - largest_left_over_.begin();
    return {.by_row = rows_of(features_, static_cast<std::size_t>(rank)),
            .pivots = {pivots_.begin(), pivots_.begin() + rank},
            .left_over = {largest_left_over_.begin(), beyond},
            .stride = stride_};
}

bool KernelFactorisation::is_within(std::size_t most_features, double tolerance) {
    const std::size_t most = std::min(most_features, rows_);
    extend_to(tolerance, most);
    const double left_over =
        pivots_.size() > most ? largest_left_over_[most] : *std::ranges::max_element(left_over_);
    return left_over <= tolerance;
}

KernelFeatures kernel_features(const LagProblem& problem, double sigma, double tolerance,
                               std::size_t stride) {
    return KernelFactorisation(problem, sigma, stride).features(tolerance);
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
