#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "regression/folds.hpp"
#include "regression/kernel_features.hpp"
#include "regression/tube_solver.hpp"

namespace thermbal {

/// One fold at one sigma: a solver on its training rows and what is held out, of those rows that the features
/// have. One object a thread.
class HeldOutFold {
  public:
    /// `targets`: one a row of the problem.
    HeldOutFold(const KernelFeatures& kernel, const Fold& fold, const Eigen::VectorXd& targets,
                double epsilon);

    void start(double C, const TubeSolver::State& from) { solver_.start(C, from); }
    /// Goes on to this smoothing of the loss; the root of the held-out mean squared error there, [0, 1]
    /// scale.
    double rmse_at(double smoothing);

    const TubeSolver& solver() const { return solver_; }

  private:
    void descend_patiently(double smoothing);

    TubeSolver solver_;
    Eigen::MatrixXd held_out_;
    Eigen::VectorXd held_out_targets_;
};

}  // namespace thermbal
