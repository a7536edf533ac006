#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "held_out_fold.hpp"
#include "regression/folds.hpp"
#include "regression/kernel_features.hpp"
#include "regression/lags.hpp"
#include "regression/sweep.hpp"
#include "regression/tube_solver.hpp"

namespace thermbal {

/// A point of the grid after a rough fit of its first fold.
struct SigmaCandidate {
    std::size_t sigma_index = 0;
    std::size_t C_index = 0;
    double rough_rmse = 0.0;
    double lowest_rmse = 0.0;  ///< below which the first fold's error will not fall
    TubeSolver::State rough_state;
};

/// The first fold's error that is hopeless where the best mean squared error over `folds` folds is
/// `best_mean_mse`.
double hopeless_rmse(double best_mean_mse, std::size_t folds);

/// Cross-validation of every C at one sigma. The arguments must outlive it; one object a thread.
class SigmaColumn {
  public:
    SigmaColumn(const LagProblem& problem, std::size_t sigma_index, const std::vector<Fold>& folds,
                const SweepOptions& options);

    /// The first fold roughly, from the largest C down, each from the one before; with `skip_hopeless` no
    /// further than where the error is hopeless and grows. At least one candidate. Error: stop when
    /// cancelled.
    Result<std::vector<SigmaCandidate>> look_for_candidates(double best_mean_mse, bool skip_hopeless,
                                                            const Cancelled& cancelled);

    /// The mean over folds, or nothing as soon as it is sure to be above `bound`. `least_rmse`: what no error
    /// is expected to fall below, fold by fold. Error: stop when cancelled.
    Result<std::optional<double>> mean_mse(const SigmaCandidate& candidate, double bound,
                                           const std::vector<double>& least_rmse, const Cancelled& cancelled);

    /// What is kept between calls of mean_mse(), in numbers; and lets go of it: the next call makes it again.
    std::size_t kept_numbers() const;
    void release();

  private:
    const KernelFeatures& kernel();
    HeldOutFold& fold(std::size_t f);
    TubeSolver::State on_all_rows(const TubeSolver::State& rough);
    void start_fold(std::size_t f, const SigmaCandidate& candidate);

    const LagProblem& problem_;
    std::size_t sigma_index_;
    double sigma_;
    const std::vector<Fold>& folds_;
    const SweepOptions& options_;
    Eigen::VectorXd targets_;
    KernelFeatures rough_;
    std::optional<KernelFeatures> kernel_;
    std::optional<NewtonSystem> system_;  ///< of all folds
    std::vector<std::optional<HeldOutFold>> fitted_;
};

}  // namespace thermbal
