#include "held_out_fold.hpp"

#include <cmath>

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

HeldOutFold::HeldOutFold(const KernelFeatures& kernel, const Fold& fold, const VectorXd& targets,
                         double epsilon)
    : solver_(kernel.features(feature_rows(fold.training_rows, kernel.stride), Eigen::all),
              targets(problem_rows(fold.training_rows, kernel.stride)), epsilon),
      held_out_(kernel.features(feature_rows(fold.held_out_rows, kernel.stride), Eigen::all)),
      held_out_targets_(targets(problem_rows(fold.held_out_rows, kernel.stride))) {}

double HeldOutFold::rmse_at(double smoothing) {
    if (!solver_.descend_to(smoothing, quick_steps)) descend_patiently(smoothing);
    const VectorXd error =
        ((held_out_ * solver_.state().weights).array() + solver_.state().bias).matrix() - held_out_targets_;
    return std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
}

void HeldOutFold::descend_patiently(double smoothing) {
    for (double wide = 0.5; wide > smoothing; wide *= 0.3) {
        static_cast<void>(solver_.descend_to(wide, patient_steps));
    }
    static_cast<void>(solver_.descend_to(smoothing, patient_steps));
}

}  // namespace thermbal
