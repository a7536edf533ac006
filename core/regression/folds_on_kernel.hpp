#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "regression/dual_solver.hpp"
#include "regression/folds.hpp"
#include "regression/whole_kernel.hpp"

namespace thermbal {

/// HeldOutFold on a whole kernel matrix: one fold at one sigma, of those rows that the kernel has. One object
/// a thread.
class HeldOutOfKernel {
  public:
    /// `targets` and `workspace`: as DualSolver's.
    HeldOutOfKernel(const WholeKernel& kernel, const Fold& fold, const Eigen::VectorXd& targets,
                    double epsilon, DualSolver::Workspace& workspace);

    void start(double C, DualSolver::State from) { solver_.start(C, std::move(from)); }
    /// As HeldOutFold's.
    double rmse_at(double smoothing);

    const DualSolver& solver() const { return solver_; }

  private:
    DualSolver solver_;
    std::vector<Eigen::Index> held_out_;
};

/// All folds of a cross-validation on the same kernel, each made when it is first asked for. `folds` must
/// outlive it; one object a thread.
class FoldsOnKernel {
  public:
    /// `targets`: one a row of the problem.
    FoldsOnKernel(WholeKernel kernel, const std::vector<Fold>& folds, const Eigen::VectorXd& targets,
                  double epsilon);
    FoldsOnKernel(const FoldsOnKernel&) = delete;

    HeldOutOfKernel& operator[](std::size_t f) {
        if (!fitted_[f]) fitted_[f].emplace(kernel_, folds_[f], targets_, epsilon_, workspace_);
        return *fitted_[f];
    }
    /// The function with these coefficients at these rows of the problem, which must be the kernel's, too.
    DualSolver::State state_of(const std::vector<std::size_t>& rows, const std::vector<double>& coefficients,
                               double bias) const;
    std::size_t kept_numbers() const { return static_cast<std::size_t>(kernel_.by_row.size()); }

  private:
    WholeKernel kernel_;
    const std::vector<Fold>& folds_;
    Eigen::VectorXd targets_;  ///< of the kernel's rows, and zeros
    double epsilon_;
    DualSolver::Workspace workspace_;
    std::vector<std::optional<HeldOutOfKernel>> fitted_;
};

}  // namespace thermbal
