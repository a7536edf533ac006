#include "held_out_fold.hpp"

#include <cmath>

#include "regression/vector_loops.hpp"

namespace thermbal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int quick_steps = 100;
/// Not seen to fall short at one smoothing; the state is the best there is in any case.
constexpr int patient_steps = 1000;

std::vector<Index> problem_rows(const std::vector<std::size_t>& rows, std::size_t stride) {
    std::vector<Index> kept;
    for (const std::size_t row : rows) {
        if (row % stride == 0) kept.push_back(static_cast<Index>(row));
    }
    return kept;
}

std::vector<Index> feature_rows(const std::vector<std::size_t>& rows, std::size_t stride) {
    std::vector<Index> kept = problem_rows(rows, stride);
    for (Index& row : kept) row /= static_cast<Index>(stride);
    return kept;
}

}  // namespace

HeldOutFold::HeldOutFold(const KernelFeatures& kernel, NewtonSystem& system, const Fold& fold,
                         const VectorXd& targets, double epsilon)
    : solver_(system, feature_rows(fold.training_rows, kernel.stride),
              targets(problem_rows(fold.training_rows, kernel.stride)), epsilon),
      by_row_(&system.by_row()),
      held_out_(feature_rows(fold.held_out_rows, kernel.stride)),
      held_out_targets_(targets(problem_rows(fold.held_out_rows, kernel.stride))) {}

double HeldOutFold::rmse_at(double smoothing) {
    if (!solver_.descend_to(smoothing, quick_steps)) descend_patiently(smoothing);
    const TubeSolver::State& state = solver_.state();
    VectorXd error(held_out_targets_.size());
    vector_loops::multiply_rows(by_row_->data(), static_cast<std::size_t>(by_row_->rows()), held_out_,
                                state.weights.data(), state.bias, error.data());
    error -= held_out_targets_;
    return std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
}

void HeldOutFold::descend_patiently(double smoothing) {
    for (double wide = 0.5; wide > smoothing; wide *= 0.3) {
        static_cast<void>(solver_.descend_to(wide, patient_steps));
    }
    static_cast<void>(solver_.descend_to(smoothing, patient_steps));
}

}  // namespace thermbal
