#include "folds_on_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "fold_descent.hpp"
#include "regression/vector_loops.hpp"

namespace thermbal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd ones_at(const std::vector<Index>& rows, Index count) {
    VectorXd ones = VectorXd::Zero(count);
    for (const Index row : rows) ones(row) = 1.0;
    return ones;
}

VectorXd targets_on(const WholeKernel& kernel, const VectorXd& targets) {
    VectorXd of_rows = VectorXd::Zero(kernel.by_row.rows());
    of_rows.head(kernel.by_row.cols()) =
        targets(Eigen::seq(0, Eigen::last, static_cast<Index>(kernel.stride)));
    return of_rows;
}

}  // namespace

HeldOutOfKernel::HeldOutOfKernel(const WholeKernel& kernel, const Fold& fold, const VectorXd& targets,
                                 double epsilon, DualSolver::Workspace& workspace)
    : solver_(kernel, targets, ones_at(kernel_rows(fold.training_rows, kernel.stride), targets.size()),
              epsilon, workspace),
      held_out_(kernel_rows(fold.held_out_rows, kernel.stride)) {}

double HeldOutOfKernel::rmse_at(double smoothing) {
    descend_surely(solver_, smoothing);
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

DualSolver::State FoldsOnKernel::state_of(const std::vector<std::size_t>& rows,
                                          const std::vector<double>& coefficients, double bias) const {
    DualSolver::State state{VectorXd::Zero(targets_.size()), bias, targets_.array() - bias};
    const std::vector<Index> of_kernel = kernel_rows(rows, kernel_.stride);
    std::vector<double> factors(coefficients.size());
    std::ranges::transform(coefficients, factors.begin(), std::negate{});
    for (std::size_t k = 0; k < of_kernel.size(); ++k) state.coefficients(of_kernel[k]) = coefficients[k];
    vector_loops::add_rows(kernel_.by_row.data(), static_cast<std::size_t>(kernel_.by_row.rows()), of_kernel,
                           factors, state.residuals.data());
    return state;
}

}  // namespace thermbal
