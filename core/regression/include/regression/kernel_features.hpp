#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "regression/lags.hpp"

namespace thermbal {

/// Every stride-th row of a problem (column k of by_row belongs to row k * stride) under
/// a Gaussian kernel matrix of low rank: kernel(i, j) = by_row.col(i) . by_row.col(j), up to the
/// tolerance it was made with. The lagged rows of a filtered warm-up lie close to a smooth curve, so that 5
/// to 50 features do for 1600 rows.
struct KernelFeatures {
    Eigen::MatrixXd by_row;  ///< rank, with zeros up to a multiple of eight, x (rows / stride, rounded up)
    std::vector<std::size_t> pivots;  ///< the rows (of the problem) whose kernel functions the features span
    std::vector<double> left_over;    ///< the largest error of a diagonal element before each pivot, falling
    std::size_t stride = 1;

    /// How many of the features, the first ones, keep to a wider tolerance.
    std::size_t rank_at(double tolerance) const;
};

/// Cholesky's factorisation with diagonal pivoting (Fine & Scheinberg 2001), until no diagonal element is off
/// by more than a tolerance; a function with weights c is then off by at most tolerance * |c|_1. It goes on
/// from where it is when a smaller tolerance is asked for. `problem` must outlive it.
class KernelFactorisation {
  public:
    explicit KernelFactorisation(const LagProblem& problem, double sigma, std::size_t stride = 1);
    KernelFactorisation(const KernelFactorisation&) = delete;
    KernelFactorisation(KernelFactorisation&&) = default;

    KernelFeatures features(double tolerance);
    /// Whether that many features at most keep to the tolerance; stops where they do not.
    bool is_within(std::size_t most_features, double tolerance);
    std::size_t kept_numbers() const { return features_.size() * rows_; }

  private:
    void extend_to(double tolerance, std::size_t most_features);
    void add_pivot(std::size_t pivot);

    const LagProblem* problem_;
    double sigma_;
    std::size_t stride_;
    std::size_t rows_;
    std::vector<std::vector<double>> phases_;  ///< every stride-th sample, from the first, the second ... on
    std::vector<const double*> lagged_;        ///< lag l of row k * stride is lagged_[l][k]
    std::vector<double> left_over_;            ///< of every diagonal element
    std::vector<std::vector<double>> features_;
    std::vector<const double*> columns_;  ///< features_
    std::vector<std::size_t> pivots_;
    std::vector<double> largest_left_over_;  ///< before each pivot, falling
};

/// The features of one factorisation.
KernelFeatures kernel_features(const LagProblem& problem, double sigma, double tolerance,
                               std::size_t stride = 1);

/// The tolerance at which a fit is off by less than about 5e-6 on the [0, 1] scale: wide kernels carry large
/// coefficients, so theirs is smaller (measured: |c|_1 stays below 250 sigma^2).
double feature_tolerance(double sigma);

/// c with sum_k c_k k(x_pivot_k, x) = weights . features(x). Weights: as many as by_row has rows, here and
/// below.
std::vector<double> pivot_coefficients(const KernelFeatures& kernel, const Eigen::VectorXd& weights);

/// The weights on `features` of the function that has these coefficients at these rows: `features` must hold
/// those rows.
Eigen::VectorXd weights_of(const KernelFeatures& features, const std::vector<std::size_t>& rows,
                           const std::vector<double>& coefficients);

}  // namespace thermbal
