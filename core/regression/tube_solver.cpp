#include "regression/tube_solver.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/median.hpp"
#include "tube_loss.hpp"

namespace thermbal {

using Eigen::Index;
using Eigen::VectorXd;

TubeSolver::TubeSolver(NewtonSystem& system, std::vector<Index> rows, VectorXd targets, double epsilon)
    : system_(&system),
      rows_(std::move(rows)),
      targets_(std::move(targets)),
      epsilon_(epsilon),
      residuals_(targets_.size()),
      slopes_(VectorXd::Zero(targets_.size())),
      new_slopes_(targets_.size()),
      slope_sum_(VectorXd::Zero(system.by_row().rows())),
      change_(targets_.size()) {}

TubeSolver::State TubeSolver::cold_start() const {
    return {VectorXd::Zero(slope_sum_.size()), upper_median({targets_.begin(), targets_.end()})};
}

void TubeSolver::predict_rows(const VectorXd& weights, double bias, VectorXd& out) const {
    vector_loops::multiply_rows(system_->by_row().data(), static_cast<std::size_t>(weights.size()), rows_,
                                weights.data(), bias, out.data());
}

void TubeSolver::start(double C, const State& start) {
    state_ = start;
    predict_rows(state_.weights, state_.bias, residuals_);
    residuals_ = targets_ - residuals_;
    // Rows that C holds back stay held back: their slopes grow with it.
    slopes_ *= C / tube_.C;
    slope_sum_ *= C / tube_.C;
    tube_.C = C;
    tube_.epsilon = epsilon_;
}

/// One Newton step from the cold start, on the loss with every row on its quadratic piece and no epsilon.
void TubeSolver::start_at_least_squares(double C, double smoothing) {
    start(C, cold_start());
    tube_.smoothing = smoothing;
    const double curvature = C / smoothing;
    slope_changes_.assign(residuals_.begin(), residuals_.end());
    for (double& slope : slope_changes_) slope *= -curvature;
    gradient_.setZero(slope_sum_.size());
    vector_loops::add_rows(system_->by_row().data(), static_cast<std::size_t>(slope_sum_.size()), rows_,
                           slope_changes_, gradient_.data());
    bias_gradient_ = std::accumulate(slope_changes_.begin(), slope_changes_.end(), 0.0);
    system_->solve(rows_, curvature, gradient_, bias_gradient_, direction_);
    start(C, {direction_.weights, state_.bias + direction_.bias});
}

bool TubeSolver::descend_to(double smoothing, int most_steps) {
    const bool converged = descend(smoothing, 0.3 * smoothing, most_steps);
    take_slopes();
    centre_undetermined_bias();
    return converged;
}

bool TubeSolver::fit(double C, const State& from, const Schedule& schedule) {
    start(C, from);
    double smoothing = std::max(schedule.first_smoothing, schedule.last_smoothing);
    while (smoothing > schedule.last_smoothing) {
        if (!descend(smoothing, 0.3 * smoothing, schedule.most_steps)) return false;
        smoothing = std::max(smoothing * schedule.factor, schedule.last_smoothing);
    }
    const bool converged = descend(smoothing, 1e-3 * smoothing, schedule.most_steps);
    take_slopes();
    centre_undetermined_bias();
    return converged;
}

/// Newton steps at one smoothing, until a full one would move no prediction by more than `still`.
bool TubeSolver::descend(double smoothing, double still, int most_steps) {
    tube_.smoothing = smoothing;
    for (int step = 0; step < most_steps; ++step) {
        ++newton_steps_;
        take_slopes();
        gradient_ = state_.weights - slope_sum_;
        bias_gradient_ = -slopes_.sum();
        newton_direction();
        predict_rows(direction_.weights, direction_.bias, change_);
        const double length = step_length();
        if (length == 0.0) return true;
        state_.weights += length * direction_.weights;
        state_.bias += length * direction_.bias;
        residuals_ -= length * change_;
        if (change_.lpNorm<Eigen::Infinity>() <= still) return true;
    }
    return false;
}

/// Few rows change their slope from one step to the next: the sum over rows is brought up to date by those
/// alone.
void TubeSolver::take_slopes() {
    vector_loops::loss_slopes(residuals_.data(), static_cast<std::size_t>(residuals_.size()), tube_,
                              new_slopes_.data());
    // Without a branch: which rows bend or change follows no pattern.
    const std::size_t count = rows_.size();
    bending_.resize(count);
    changed_.resize(count);
    slope_changes_.resize(count);
    std::size_t bends = 0;
    std::size_t changes = 0;
    for (std::size_t i = 0; i < count; ++i) {
        double& slope = slopes_.data()[i];
        const double new_slope = new_slopes_.data()[i];
        const double size = std::abs(new_slope);
        bending_[bends] = changed_[changes] = rows_[i];
        slope_changes_[changes] = new_slope - slope;
        bends += static_cast<std::size_t>((size > 0.0) & (size < tube_.C));
        changes += static_cast<std::size_t>(new_slope != slope);
        slope = new_slope;
    }
    bending_.resize(bends);
    changed_.resize(changes);
    slope_changes_.resize(changes);
    vector_loops::add_rows(system_->by_row().data(), static_cast<std::size_t>(slope_sum_.size()), changed_,
                           slope_changes_, slope_sum_.data());
}

void TubeSolver::newton_direction() {
    const double curvature = tube_.C / tube_.smoothing;
    if (bending_.empty()) {
        direction_ = {-gradient_, -bias_gradient_ / (1e-3 * curvature)};
    } else {
        system_->solve(bending_, curvature, gradient_, bias_gradient_, direction_);
    }
}

double TubeSolver::step_length() const {
    return length_of_step(
        {.first_slope = gradient_.dot(direction_.weights) + bias_gradient_ * direction_.bias,
         .along = state_.weights.dot(direction_.weights),
         .square = direction_.weights.squaredNorm()},
        residuals_, change_, tube_);
}

void TubeSolver::centre_undetermined_bias() {
    if (!bending_.empty()) return;
    const double move = move_to_middle(residuals_, slopes_, epsilon_);
    state_.bias += move;
    residuals_.array() -= move;
}

bool TubeSolver::is_free_of_C() const {
    return slopes_.lpNorm<Eigen::Infinity>() < tube_.C;
}

double TubeSolver::duality_gap() const {
    const double loss = (residuals_.array().abs() - epsilon_).max(0.0).sum();
    const double primal = 0.5 * state_.weights.squaredNorm() + tube_.C * loss;
    // A dual point must sum to 0: what is left over is taken from the largest coefficients of that sign.
    VectorXd feasible = slopes_;
    double left_over = feasible.sum();
    for (Index i = 0; i < feasible.size() && left_over != 0.0; ++i) {
        if (feasible(i) * left_over <= 0.0) continue;
        const double taken = std::copysign(std::min(std::abs(feasible(i)), std::abs(left_over)), left_over);
        feasible(i) -= taken;
        left_over -= taken;
    }
    const VectorXd weights = system_->by_row()(Eigen::all, rows_) * feasible;
    const double dual =
        targets_.dot(feasible) - epsilon_ * feasible.lpNorm<1>() - 0.5 * weights.squaredNorm();
    return primal - dual;
}

}  // namespace thermbal
