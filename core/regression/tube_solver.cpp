#include "regression/tube_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Dense>

#include "base/median.hpp"

namespace thermbal {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TubeSolver::TubeSolver(MatrixXd features, VectorXd targets, double epsilon)
    : features_(std::move(features)),
      by_row_(features_.transpose()),
      targets_(std::move(targets)),
      epsilon_(epsilon),
      residuals_(targets_.size()),
      slopes_(VectorXd::Zero(targets_.size())),
      new_slopes_(targets_.size()),
      slope_sum_(VectorXd::Zero(features_.cols())),
      change_(targets_.size()) {}

TubeSolver::State TubeSolver::cold_start() const {
    return {VectorXd::Zero(features_.cols()), upper_median({targets_.begin(), targets_.end()})};
}

void TubeSolver::start(double C, const State& start) {
    state_ = start;
    vector_loops::multiply_columns(features_.data(), static_cast<std::size_t>(features_.rows()),
                                   static_cast<std::size_t>(features_.cols()), state_.weights.data(),
                                   state_.bias, residuals_.data());
    residuals_ = targets_ - residuals_;
    // Rows that C holds back stay held back: their slopes grow with it.
    slopes_ *= C / tube_.C;
    slope_sum_ *= C / tube_.C;
    tube_.C = C;
    tube_.epsilon = epsilon_;
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
        vector_loops::multiply_columns(features_.data(), static_cast<std::size_t>(features_.rows()),
                                       static_cast<std::size_t>(features_.cols()), direction_.data(),
                                       bias_direction_, change_.data());
        const double length = step_length();
        if (length == 0.0) return true;
        state_.weights += length * direction_;
        state_.bias += length * bias_direction_;
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
    bending_.clear();
    for (Index i = 0; i < slopes_.size(); ++i) {
        const double slope = new_slopes_(i);
        const double size = std::abs(slope);
        if (size > 0.0 && size < tube_.C) bending_.push_back(i);
        if (slope == slopes_(i)) continue;
        slope_sum_ += (slope - slopes_(i)) * by_row_.col(i);
        slopes_(i) = slope;
    }
}

/// Solves (I + k X'X) d + k X'1 e = -g, k 1'(X d + 1 e) = -g_b, X the rows where the loss bends, k their
/// curvature: in the space of the features or in that of the rows, whichever is smaller.
void TubeSolver::newton_direction() {
    const double curvature = tube_.C / tube_.smoothing;
    const auto rows = static_cast<Index>(bending_.size());
    if (rows == 0) {
        direction_ = -gradient_;
        bias_direction_ = -bias_gradient_ / (1e-3 * curvature);
    } else if (rows > features_.cols()) {
        direction_in_feature_space(curvature);
    } else {
        direction_in_row_space(curvature);
    }
}

void TubeSolver::direction_in_feature_space(double curvature) {
    const Index rank = features_.cols();
    const auto rows = static_cast<double>(bending_.size());
    const MatrixXd& gram = feature_gram_.over(by_row_, bending_);
    VectorXd mean = VectorXd::Zero(rank);
    for (const Index row : bending_) mean += by_row_.col(row);
    mean /= rows;
    system_ = curvature * gram.topLeftCorner(rank, rank);
    system_.selfadjointView<Eigen::Lower>().rankUpdate(mean, -curvature * rows);
    system_.diagonal().array() += 1.0;
    const Eigen::LLT<Eigen::Ref<MatrixXd>> factor(system_);
    direction_ = factor.solve(mean * bias_gradient_ - gradient_);
    bias_direction_ = -bias_gradient_ / (curvature * rows) - mean.dot(direction_);
}

void TubeSolver::direction_in_row_space(double curvature) {
    const auto rows = static_cast<Index>(bending_.size());
    bent_.resize(features_.cols(), rows);
    for (Index k = 0; k < rows; ++k) bent_.col(k) = by_row_.col(bending_[static_cast<std::size_t>(k)]);
    system_ = row_gram_.over(bent_, bending_);
    system_.diagonal().array() += 1.0 / curvature;
    const Eigen::LLT<Eigen::Ref<MatrixXd>> factor(system_);
    const VectorXd without_bias = factor.solve(-(bent_.transpose() * gradient_));
    const VectorXd of_bias = factor.solve(VectorXd::Ones(rows));
    bias_direction_ = (-bias_gradient_ - without_bias.sum()) / of_bias.sum();
    direction_ = -gradient_ - bent_ * (without_bias + bias_direction_ * of_bias);
}

/// The objective along the direction is convex and piecewise quadratic: safeguarded Newton to a slope a fifth
/// of the first.
double TubeSolver::step_length() {
    const double first_slope = gradient_.dot(direction_) + bias_gradient_ * bias_direction_;
    if (!(first_slope < 0.0)) return 0.0;
    const double along = state_.weights.dot(direction_);
    const double square = direction_.squaredNorm();
    const double enough = 0.2 * std::abs(first_slope);
    double low = 0.0;
    double high = std::numeric_limits<double>::infinity();
    double t = 1.0;
    for (int trial = 0; trial < 60; ++trial) {
        const auto loss = vector_loops::derivatives_along(residuals_.data(), change_.data(), t,
                                                          static_cast<std::size_t>(residuals_.size()), tube_);
        const double slope = along + t * square - loss.first;
        if (std::abs(slope) <= enough) break;
        (slope < 0.0 ? low : high) = t;
        const double next = t - slope / (square + loss.second);
        if (next > low && next < high) {
            t = next;
        } else if (std::isinf(high)) {
            t = 4.0 * t;
        } else {
            t = trial % 2 == 0 ? 0.5 * (low + high) : low + 0.1 * (high - low);
        }
    }
    return t;
}

/// Without a row on the edge of the tube the bias may lie anywhere between two of them; libsvm takes the
/// middle.
void TubeSolver::centre_undetermined_bias() {
    if (!bending_.empty()) return;
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < residuals_.size(); ++i) {
        const double to_upper_edge = residuals_(i) - epsilon_;
        const double to_lower_edge = residuals_(i) + epsilon_;
        if (slopes_(i) == 0.0) lowest = std::max(lowest, to_upper_edge);
        if (slopes_(i) < 0.0) lowest = std::max(lowest, to_lower_edge);
        if (slopes_(i) == 0.0) highest = std::min(highest, to_lower_edge);
        if (slopes_(i) > 0.0) highest = std::min(highest, to_upper_edge);
    }
    if (std::isinf(lowest) || std::isinf(highest) || lowest >= highest) return;
    const double move = 0.5 * (lowest + highest);
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
    const VectorXd weights = by_row_ * feasible;
    const double dual =
        targets_.dot(feasible) - epsilon_ * feasible.lpNorm<1>() - 0.5 * weights.squaredNorm();
    return primal - dual;
}

}  // namespace thermbal
