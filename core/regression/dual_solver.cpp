#include "regression/dual_solver.hpp"

#include <cmath>
#include <utility>

#include "base/median.hpp"
#include "tube_loss.hpp"

namespace thermbal {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// A coefficient this near to its slope, in C, is taken for it: the difference moves no prediction by more
/// than so much of the smoothing.
constexpr double rounding = 1e-9;

}  // namespace

DualSolver::DualSolver(const WholeKernel& kernel, const VectorXd& targets, VectorXd is_trained,
                       double epsilon, Workspace& workspace)
    : kernel_(&kernel),
      targets_(&targets),
      is_trained_(std::move(is_trained)),
      tube_{.C = 1.0, .epsilon = epsilon, .smoothing = 1.0},
      slopes_(VectorXd::Zero(targets.size())),
      direction_(targets.size()),
      of_kernel_(targets.size()),
      change_(targets.size()),
      workspace_(&workspace) {}

DualSolver::State DualSolver::cold_start() const {
    std::vector<double> trained;
    for (Index i = 0; i < targets_->size(); ++i) {
        if (is_trained_(i) != 0.0) trained.push_back((*targets_)(i));
    }
    const double bias = upper_median(std::move(trained));
    return {VectorXd::Zero(targets_->size()), bias, targets_->array() - bias};
}

void DualSolver::start(double C, State from) {
    state_ = std::move(from);
    tube_.C = C;
}

bool DualSolver::descend_to(double smoothing, int most_steps) {
    const bool converged = descend(smoothing, 0.3 * smoothing, most_steps);
    take_slopes();
    centre_undetermined_bias();
    return converged;
}

bool DualSolver::descend(double smoothing, double still, int most_steps) {
    tube_.smoothing = smoothing;
    for (int step = 0; step < most_steps; ++step) {
        take_slopes();
        newton_direction();
        const double length = step_length();
        if (length == 0.0) return true;
        state_.coefficients += length * direction_;
        state_.bias += length * bias_direction_;
        state_.residuals.array() -= length * (of_kernel_.array() + bias_direction_);
        if (change_.lpNorm<Eigen::Infinity>() <= still) return true;
    }
    return false;
}

void DualSolver::centre_undetermined_bias() {
    if (!bending_.empty()) return;
    std::vector<Index> trained;
    for (Index i = 0; i < is_trained_.size(); ++i) {
        if (is_trained_(i) != 0.0) trained.push_back(i);
    }
    const double move = move_to_middle(state_.residuals(trained), slopes_(trained), tube_.epsilon);
    state_.bias += move;
    state_.residuals.array() -= move;
}

/// Most rows neither bend nor change: they take no part in the step.
void DualSolver::take_slopes() {
    vector_loops::loss_slopes(state_.residuals.data(), static_cast<std::size_t>(slopes_.size()), tube_,
                              slopes_.data());
    slopes_.array() *= is_trained_.array();
    const std::size_t count = kernel_->rows();
    bending_.resize(count);
    moving_.resize(count);
    excess_.resize(count);
    const double negligible = rounding * tube_.C;
    std::size_t bends = 0;
    std::size_t moves = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const double slope = slopes_.data()[i];
        const double size = std::abs(slope);
        const double excess = state_.coefficients.data()[i] - slope;
        bending_[bends] = moving_[moves] = static_cast<Index>(i);
        excess_[moves] = excess;
        bends += static_cast<std::size_t>((size > 0.0) & (size < tube_.C));
        moves += static_cast<std::size_t>(std::abs(excess) > negligible);
    }
    bending_.resize(bends);
    moving_.resize(moves);
    excess_.resize(moves);
}

void DualSolver::add_kernel_columns(const std::vector<Index>& rows, const std::vector<double>& factors) {
    vector_loops::add_rows(kernel_->by_row.data(), static_cast<std::size_t>(kernel_->by_row.rows()), rows,
                           factors, of_kernel_.data());
}

/// With g = coefficients - slopes and k the curvature: the step is -g, and z besides where the loss bends,
/// (K_BB + I / k) z + e = (K g)_B, and z sums to the gradient of the bias.
void DualSolver::newton_direction() {
    const double curvature = tube_.C / tube_.smoothing;
    const double bias_gradient = -slopes_.sum();
    direction_.setZero();
    of_kernel_.setZero();
    for (std::size_t k = 0; k < moving_.size(); ++k) {
        excess_[k] = -excess_[k];
        direction_(moving_[k]) = excess_[k];
    }
    add_kernel_columns(moving_, excess_);
    if (bending_.empty()) {
        bias_direction_ = -bias_gradient / (1e-3 * curvature);
    } else {
        step_where_bending(curvature, bias_gradient, *workspace_);
    }
    change_ = (of_kernel_.array() + bias_direction_) * is_trained_.array();
}

void DualSolver::step_where_bending(double curvature, double bias_gradient, Workspace& work) {
    pick_lower(kernel_->by_row.data(), static_cast<std::size_t>(kernel_->by_row.rows()), bending_,
               work.system);
    for (std::size_t i = 0; i < work.system.padded_rows(); ++i) work.system.at(i, i) += 1.0 / curvature;
    work.factor.factor(work.system);
    const auto bends = static_cast<Index>(bending_.size());
    const auto padded = static_cast<Index>(work.system.padded_rows());
    work.at_bending.setZero(padded);
    for (Index b = 0; b < bends; ++b) {
        work.at_bending(b) = -of_kernel_(bending_[static_cast<std::size_t>(b)]);
    }
    work.factor.solve_lower(work.at_bending.data());
    work.of_bias.setZero(padded);
    work.of_bias.head(bends).setOnes();
    work.factor.solve_lower(work.of_bias.data());
    bias_direction_ = (work.of_bias.dot(work.at_bending) - bias_gradient) / work.of_bias.squaredNorm();
    work.at_bending -= bias_direction_ * work.of_bias;
    work.factor.solve_upper(work.at_bending.data());
    work.of_bending.assign(work.at_bending.data(), work.at_bending.data() + bends);
    for (std::size_t b = 0; b < bending_.size(); ++b) direction_(bending_[b]) += work.of_bending[b];
    add_kernel_columns(bending_, work.of_bending);
}

double DualSolver::step_length() const {
    double first_slope = -slopes_.sum() * bias_direction_;
    // excess_ has been negated.
    for (std::size_t k = 0; k < moving_.size(); ++k) first_slope -= excess_[k] * of_kernel_(moving_[k]);
    return length_of_step({.first_slope = first_slope,
                           .along = state_.coefficients.dot(of_kernel_),
                           .square = direction_.dot(of_kernel_)},
                          state_.residuals, change_, tube_);
}

}  // namespace thermbal
