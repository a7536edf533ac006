#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "regression/panels.hpp"

namespace thermbal {

/// Sums and products over the rows where a loss bends. From one Newton step to the next few rows begin or
/// cease to bend, so both are brought up to date instead of being made anew. `by_row` (rank, a multiple of
/// eight, x rows: one row's features side by side) must be the same at every call, `bending` ascending.

/// The sum of x x' over the bending rows, rank x rank.
class FeatureGram {
  public:
    const PanelMatrix& over(const Eigen::MatrixXd& by_row, const std::vector<Eigen::Index>& bending);
    std::size_t kept_numbers() const { return sum_.numbers() + sum_of_all_.numbers(); }

  private:
    void start_from_nothing(std::size_t rank);
    void start_from_all(const Eigen::MatrixXd& by_row);
    void add(const Eigen::MatrixXd& by_row, const std::vector<Eigen::Index>& rows, double sign,
             PanelMatrix& sum);

    PanelMatrix sum_;
    std::vector<Eigen::Index> rows_;  ///< in sum_
    int changes_ = 0;                 ///< since sum_ was made anew
    PanelMatrix sum_of_all_;
    std::vector<Eigen::Index> entering_, leaving_;
    PanelMatrix gathered_;
};

/// The inner products of the bending rows with one another. Where there are few rows: made anew, until that
/// has cost as much as those of all rows would, from which they are then picked. Otherwise brought up to
/// date.
class RowGram {
  public:
    /// `out`: the lower triangle, zeros in the padding.
    void over(const Eigen::MatrixXd& by_row, const std::vector<Eigen::Index>& bending, PanelMatrix& out);
    std::size_t kept_numbers() const {
        return products_.numbers() + new_products_.numbers() + static_cast<std::size_t>(of_all_.size());
    }

  private:
    bool is_all_cheaper_by_now(std::size_t bending, std::size_t all);
    void multiply(const Eigen::MatrixXd& by_row, const std::vector<Eigen::Index>& bending, PanelMatrix& out);
    void follow(const Eigen::MatrixXd& by_row, const std::vector<Eigen::Index>& bending);
    void multiply_all(const Eigen::MatrixXd& by_row);
    void find_kept_and_fresh(const std::vector<Eigen::Index>& bending);
    void bring_up_to_date(const Eigen::MatrixXd& by_row, const std::vector<Eigen::Index>& bending);

    Eigen::MatrixXd of_all_;
    std::size_t blocks_made_ = 0;  ///< of eight by eight products, before of_all_
    PanelMatrix products_, new_products_;
    std::vector<Eigen::Index> rows_;                         ///< of products_
    std::vector<std::pair<std::size_t, std::size_t>> kept_;  ///< place among the bending rows, and in rows_
    std::vector<std::size_t> fresh_;                         ///< places among the bending rows
    std::vector<Eigen::Index> fresh_rows_;
    PanelMatrix all_by_row_, fresh_by_row_, of_fresh_;
};

/// The Newton step of a TubeSolver on rows of `by_row`, which must outlive it. Solvers on some of these rows
/// each, one after the other, may share one object and what it keeps. Deterministic; one object a thread.
class NewtonSystem {
  public:
    struct Direction {
        Eigen::VectorXd weights;
        double bias = 0.0;
    };

    explicit NewtonSystem(const Eigen::MatrixXd& by_row) : by_row_(by_row) {}

    const Eigen::MatrixXd& by_row() const { return by_row_; }

    /// Solves (I + k X'X) d + k X'1 e = -g, k 1'(X d + 1 e) = -g_b, X the bending rows, k their curvature: in
    /// the space of the features or in that of the rows, whichever is smaller. `bending` ascending, at least
    /// one.
    void solve(const std::vector<Eigen::Index>& bending, double curvature, const Eigen::VectorXd& gradient,
               double bias_gradient, Direction& direction);

    std::size_t kept_numbers() const;

  private:
    void in_feature_space(const std::vector<Eigen::Index>& bending, double curvature,
                          const Eigen::VectorXd& gradient, double bias_gradient, Direction& direction);
    void in_row_space(const std::vector<Eigen::Index>& bending, double curvature,
                      const Eigen::VectorXd& gradient, double bias_gradient, Direction& direction);

    const Eigen::MatrixXd& by_row_;
    FeatureGram feature_gram_;
    RowGram row_gram_;
    PanelMatrix system_;
    PanelCholesky factor_;
    // Kept for their memory alone.
    Eigen::VectorXd mean_;
    std::vector<double> shares_;
    Eigen::VectorXd without_bias_, of_bias_;
};

}  // namespace thermbal
