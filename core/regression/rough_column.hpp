#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "folds_on_kernel.hpp"
#include "held_out_fold.hpp"
#include "regression/folds.hpp"
#include "regression/kernel_features.hpp"
#include "regression/lags.hpp"
#include "regression/sweep.hpp"
#include "regression/tube_solver.hpp"

namespace thermbal {

/// A point of the grid after a rough fit.
struct SigmaCandidate {
    std::size_t sigma_index = 0;
    std::size_t C_index = 0;
    double rough_rmse = 0.0;                      ///< of the first fold
    double lowest_rmse = 0.0;                     ///< below which the first fold's error will not fall
    double coefficient_sum = 0.0;                 ///< of |alpha - alpha*|, about that of all rows
    double rough_mean_mse = 0.0;                  ///< over all folds, from rank_by_all_folds() alone
    std::vector<TubeSolver::State> rough_states;  ///< of the first fold, and of those fitted after it
    std::vector<DualSolver::State> rough_duals;   ///< instead, where the rank is high
};

/// What rank_by_all_folds() found at one sigma.
struct RoughRanking {
    std::vector<SigmaCandidate> candidates;
    double least_mean_mse = 0.0;  ///< of all C looked at, candidates or not
};

/// Where on one sigma's column of the grid to look: fits on every few rows, C made up for them, and not to
/// the last digit. The arguments of the constructor must outlive it; one object a thread.
class RoughColumn {
  public:
    RoughColumn(const LagProblem& problem, std::size_t sigma_index, const std::vector<Fold>& folds,
                const SweepOptions& options, const Eigen::VectorXd& targets);

    /// The first fold alone, from the largest C down, each from the one before; with `skip_hopeless` no
    /// further than where the error is hopeless and grows. At least one candidate. Error: stop when
    /// cancelled.
    Result<std::vector<SigmaCandidate>> look_at_first_fold(double best_mean_mse, bool skip_hopeless,
                                                           const Cancelled& cancelled);
    /// The same on features of all rows, the first of those that on() is asked for later. REQUIRES:
    /// has_all_rows().
    Result<std::vector<SigmaCandidate>> look_at_first_fold(FoldsOnFeatures& fitted, double best_mean_mse,
                                                           bool skip_hopeless, const Cancelled& cancelled);

    /// All folds, from the smallest C up, for windows of noise: `noise_rmse` is about what no error falls
    /// below. Whose mean is beyond the margin from `least_mse` is no candidate; after one to three such in a
    /// row, the error growing, larger C are left out. Error: stop when cancelled.
    Result<RoughRanking> rank_by_all_folds(double noise_rmse, double least_mse, const Cancelled& cancelled);

    /// Of the features: no prediction is then moved by more than a rough error may be off.
    double finest_tolerance() const;
    bool has_all_rows() const { return stride_ == 1; }

    /// On windows of noise the point that wins on all rows is among those whose rough error is at most this
    /// much larger than the least. Measured (README.md): up to 1.06, and 1.016 where no row is left out.
    double margin() const { return has_all_rows() ? 1.03 : 1.1; }

    /// The same function on other features, which must hold the rows of these; or on all rows.
    TubeSolver::State on(const FoldsOnFeatures& folds, const TubeSolver::State& rough) const;
    TubeSolver::State on(const FoldsOnFeatures& folds, const DualSolver::State& rough) const;
    DualSolver::State on(const FoldsOnKernel& folds, const TubeSolver::State& rough) const;
    DualSolver::State on(const FoldsOnKernel& folds, const DualSolver::State& rough) const;

  private:
    static DualSolver::State on(const FoldsOnKernel& folds, const KernelFeatures& kernel,
                                const TubeSolver::State& rough);
    template <typename Folds, typename States>
    std::vector<double> fit_all_folds(Folds& folds, States& states, SigmaCandidate& candidate,
                                      double smoothing, double limit_mse) const;

    const LagProblem& problem_;
    std::size_t sigma_index_;
    double sigma_;
    const std::vector<Fold>& folds_;
    const SweepOptions& options_;
    const Eigen::VectorXd& targets_;
    std::size_t stride_;
    KernelFeatures kernel_;  ///< of the candidates' rough_states; none where they are on features given
};

}  // namespace thermbal
