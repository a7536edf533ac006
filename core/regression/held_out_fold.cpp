#include "held_out_fold.hpp"

#include <cmath>

#include "fold_descent.hpp"
#include "regression/vector_loops.hpp"

namespace thermbal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd targets_at(const std::vector<Index>& rows_of_kernel, std::size_t stride, const VectorXd& targets) {
    return targets(Eigen::seq(0, Eigen::last, static_cast<Index>(stride)))(rows_of_kernel);
}

}  // namespace

HeldOutFold::HeldOutFold(const KernelFeatures& kernel, NewtonSystem& system, const Fold& fold,
                         const VectorXd& targets, double epsilon)
    : solver_(system, kernel_rows(fold.training_rows, kernel.stride),
              targets_at(kernel_rows(fold.training_rows, kernel.stride), kernel.stride, targets), epsilon),
      by_row_(&system.by_row()),
      held_out_(kernel_rows(fold.held_out_rows, kernel.stride)),
      held_out_targets_(targets_at(held_out_, kernel.stride, targets)) {}

double HeldOutFold::rmse_at(double smoothing) {
    descend_surely(solver_, smoothing);
    const TubeSolver::State& state = solver_.state();
    VectorXd error(held_out_targets_.size());
    vector_loops::multiply_rows(by_row_->data(), static_cast<std::size_t>(by_row_->rows()), held_out_,
                                state.weights.data(), state.bias, error.data());
    error -= held_out_targets_;
    return std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
}

}  // namespace thermbal
