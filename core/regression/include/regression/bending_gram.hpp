#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

namespace thermbal {

/// Sums and products over the rows where a loss bends. From one Newton step to the next few rows begin or
/// cease to bend, so both are brought up to date instead of being made anew. `by_row` (rank x rows, one row's
/// features side by side) must be the same at every call, `bending` ascending. Deterministic; one object a
/// thread.

/// The sum of x x' over the bending rows, rank x rank.
class FeatureGram {
  public:
    /// Lower triangle, padded with zeros to whole vectors.
    const Eigen::MatrixXd& over(const Eigen::MatrixXd& by_row, const std::vector<Eigen::Index>& bending);

  private:
    void start_from_nothing(Eigen::Index padded_rank);
    void start_from_all(const Eigen::MatrixXd& by_row);
    void add(const Eigen::MatrixXd& by_row, const std::vector<Eigen::Index>& rows, double sign,
             Eigen::MatrixXd& sum);

    Eigen::MatrixXd sum_;
    std::vector<Eigen::Index> rows_;  ///< in sum_
    int changes_ = 0;                 ///< since sum_ was made anew
    Eigen::MatrixXd sum_of_all_;
    std::vector<Eigen::Index> entering_, leaving_;
    Eigen::MatrixXd gathered_;
};

/// The inner products of the bending rows with one another.
class RowGram {
  public:
    /// Lower triangle. `bent`: the features of the bending rows, one column a row.
    const Eigen::MatrixXd& over(const Eigen::Ref<const Eigen::MatrixXd>& bent,
                                const std::vector<Eigen::Index>& bending);

  private:
    void make_anew(const Eigen::Ref<const Eigen::MatrixXd>& bent);
    void bring_up_to_date(const Eigen::Ref<const Eigen::MatrixXd>& bent);

    Eigen::MatrixXd products_, new_products_;
    std::vector<Eigen::Index> rows_;                           ///< of products_
    std::vector<std::pair<Eigen::Index, Eigen::Index>> kept_;  ///< place among the bending rows, and in rows_
    std::vector<Eigen::Index> fresh_;                          ///< places among the bending rows
    Eigen::MatrixXd by_feature_;
};

}  // namespace thermbal
