#include "folds_on_kernel.hpp"

#include <cmath>

#include "regression/vector_loops.hpp"

namespace thermbal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int quick_steps_on_kernel = 100;
constexpr int patient_steps_on_kernel = 1000;

std::vector<Index> kernel_rows(const std::vector<std::size_t>& rows, std::size_t stride) {
    std::vector<Index> kept;
    for (const std::size_t row : rows) {
        if (row % stride == 0) kept.push_back(static_cast<Index>(row / stride));
    }
    return kept;
}

VectorXd ones_at(const std::vector<Index>& rows, Index count) {
    VectorXd ones = VectorXd::Zero(count);
    for (const Index row : rows) ones(row) = 1.0;
    return ones;
}

VectorXd targets_on(const WholeKernel& kernel, const VectorXd& targets) {
    VectorXd of_rows = VectorXd::Zero(kernel.by_row.rows());
    for (Index k = 0; k < kernel.by_row.cols(); ++k) {
        of_rows(k) = targets(k * static_cast<Index>(kernel.stride));
    }
    return of_rows;
}

}  // namespace

HeldOutOfKernel::HeldOutOfKernel(const WholeKernel& kernel, const Fold& fold, const VectorXd& targets,
                                 double epsilon)
    : solver_(kernel, targets, ones_at(kernel_rows(fold.training_rows, kernel.stride), targets.size()),
              epsilon),
      held_out_(kernel_rows(fold.held_out_rows, kernel.stride)) {}

double HeldOutOfKernel::rmse_at(double smoothing) {
    if (!solver_.descend_to(smoothing, quick_steps_on_kernel)) {
        for (double wide = 0.5; wide > smoothing; wide *= 0.3) {
            static_cast<void>(solver_.descend_to(wide, patient_steps_on_kernel));
        }
        static_cast<void>(solver_.descend_to(smoothing, patient_steps_on_kernel));
    }
    const VectorXd& residuals = solver_.state().residuals;
    double sum = 0.0;
    for (const Index row : held_out_) sum += residuals(row) * residuals(row);
    return std::sqrt(sum / static_cast<double>(held_out_.size()));
}

FoldsOnKernel::FoldsOnKernel(WholeKernel kernel, const std::vector<Fold>& folds, const VectorXd& targets,
                             double epsilon)
    : kernel_(std::move(kernel)),
      folds_(folds),
      targets_(targets_on(kernel_, targets)),
      epsilon_(epsilon),
      fitted_(folds.size()) {}

DualSolver::State FoldsOnKernel::state_of(const std::vector<std::pair<std::size_t, double>>& coefficients,
                                          double bias) const {
    DualSolver::State state{VectorXd::Zero(targets_.size()), bias, targets_.array() - bias};
    std::vector<Index> rows;
    std::vector<double> factors;
    for (const auto& [row, coefficient] : coefficients) {
        rows.push_back(static_cast<Index>(row / kernel_.stride));
        state.coefficients(rows.back()) = coefficient;
        factors.push_back(-coefficient);
    }
    vector_loops::add_rows(kernel_.by_row.data(), static_cast<std::size_t>(kernel_.by_row.rows()), rows,
                           factors, state.residuals.data());
    return state;
}

}  // namespace thermbal
