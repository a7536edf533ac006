#include "regression/whole_kernel.hpp"

#include <algorithm>
#include <vector>

#include "regression/vector_loops.hpp"

namespace thermbal {
namespace {

using Eigen::Index;

/// The rows move on by `stride` samples: so many squares leave a distance, and as many enter.
class DistanceColumns {
  public:
    DistanceColumns(const LagProblem& problem, std::size_t stride)
        : problem_(problem), stride_(stride), phases_(stride) {
        for (std::size_t k = 0; k < problem.unit.size(); ++k) {
            phases_[k % stride].push_back(problem.unit[k]);
        }
    }

    void fill(Eigen::MatrixXd& distances) const {
        const auto rows = static_cast<std::size_t>(distances.cols());
        first(rows, distances.data());
        for (Index j = 1; j < distances.cols(); ++j) {
            distances(0, j) = distances(j, 0);
            next(static_cast<std::size_t>(j) - 1, rows - 1, distances.col(j - 1).data(),
                 distances.col(j).data() + 1);
        }
    }

  private:
    /// Sample `lag` of row 0, of row `stride`, ...
    const double* lagged(std::size_t lag) const { return phases_[lag % stride_].data() + lag / stride_; }

    void first(std::size_t rows, double* distance) const {
        std::vector<const double*> lags;
        lags.reserve(problem_.lags);
        for (std::size_t lag = 0; lag < problem_.lags; ++lag) lags.push_back(lagged(lag));
        vector_loops::squared_distances_to(lags.data(), rows, problem_.input(0).data(), problem_.lags,
                                           distance);
    }

    /// Of the `count` rows from the second on to row j + 1, from those of the rows before them to row j.
    void next(std::size_t j, std::size_t count, const double* before, double* distance) const {
        std::copy_n(before, count, distance);
        for (std::size_t k = 0; k < stride_; ++k) {
            const double* const leaving = lagged(k);
            const double* const entering = lagged(k + problem_.lags);
            vector_loops::exchange_squares(leaving, leaving[j], entering, entering[j], count, distance);
        }
    }

    const LagProblem& problem_;
    std::size_t stride_;
    std::vector<std::vector<double>> phases_;
};

}  // namespace

WholeKernel whole_kernel(const LagProblem& problem, double sigma, std::size_t stride) {
    const std::size_t rows = (problem.rows() + stride - 1) / stride;
    const auto padded = static_cast<Index>(vector_loops::padded(rows));
    WholeKernel kernel{.by_row = Eigen::MatrixXd(padded, static_cast<Index>(rows)), .stride = stride};
    kernel.by_row.bottomRows(padded - static_cast<Index>(rows)).setZero();
    DistanceColumns(problem, stride).fill(kernel.by_row);
    for (Index j = 0; j < kernel.by_row.cols(); ++j) {
        vector_loops::scaled_exp(kernel.by_row.col(j).data(), rows, -1.0 / (sigma * sigma));
    }
    return kernel;
}

}  // namespace thermbal
