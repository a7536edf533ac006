#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "regression/folds.hpp"
#include "regression/kernel_features.hpp"
#include "regression/newton_system.hpp"
#include "regression/tube_solver.hpp"

namespace thermbal {

/// One fold at one sigma: a solver on its training rows and what is held out, of those rows that the features
/// have. One object a thread.
class HeldOutFold {
  public:
    /// `targets`: one a row of the problem. `system`, on `kernel`'s features, must outlive it.
    HeldOutFold(const KernelFeatures& kernel, NewtonSystem& system, const Fold& fold,
                const Eigen::VectorXd& targets, double epsilon);

    void start(double C, const TubeSolver::State& from) { solver_.start(C, from); }
    /// As TubeSolver's.
    void start_at_least_squares(double C, double smoothing) { solver_.start_at_least_squares(C, smoothing); }
    /// Goes on to this smoothing of the loss; the root of the held-out mean squared error there, [0, 1]
    /// scale.
    double rmse_at(double smoothing);

    const TubeSolver& solver() const { return solver_; }

  private:
    TubeSolver solver_;
    const Eigen::MatrixXd* by_row_;
    std::vector<Eigen::Index> held_out_;
    Eigen::VectorXd held_out_targets_;
};

/// All folds of a cross-validation on the same features, each made when it is first asked for. The arguments
/// of the constructor but `kernel` must outlive it; one object a thread.
class FoldsOnFeatures {
  public:
    FoldsOnFeatures(KernelFeatures kernel, const std::vector<Fold>& folds, const Eigen::VectorXd& targets,
                    double epsilon)
        : kernel_(std::move(kernel)),
          system_(kernel_.by_row),
          folds_(folds),
          targets_(targets),
          epsilon_(epsilon),
          fitted_(folds.size()) {}
    FoldsOnFeatures(const FoldsOnFeatures&) = delete;

    const KernelFeatures& kernel() const { return kernel_; }
    /// The last use of this object.
    KernelFeatures take_kernel() { return std::move(kernel_); }
    HeldOutFold& operator[](std::size_t f) {
        if (!fitted_[f]) fitted_[f].emplace(kernel_, system_, folds_[f], targets_, epsilon_);
        return *fitted_[f];
    }
    std::size_t kept_numbers() const {
        return static_cast<std::size_t>(kernel_.by_row.size()) + system_.kept_numbers();
    }

  private:
    KernelFeatures kernel_;
    NewtonSystem system_;
    const std::vector<Fold>& folds_;
    const Eigen::VectorXd& targets_;
    double epsilon_;
    std::vector<std::optional<HeldOutFold>> fitted_;
};

}  // namespace thermbal
