#pragma once

#include <cstddef>
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
    /// Goes on to this smoothing of the loss; the root of the held-out mean squared error there, [0, 1]
    /// scale.
    double rmse_at(double smoothing);

    const TubeSolver& solver() const { return solver_; }

  private:
    void descend_patiently(double smoothing);

    TubeSolver solver_;
    const Eigen::MatrixXd* by_row_;
    std::vector<Eigen::Index> held_out_;
    Eigen::VectorXd held_out_targets_;
};

}  // namespace thermbal
