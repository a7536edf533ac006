#include "regression/tube_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Dense>

namespace thermbal {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Index padded(Index count) {
    return static_cast<Index>(vector_loops::padded(static_cast<std::size_t>(count)));
}

}  // namespace

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
    std::vector<double> sorted(targets_.begin(), targets_.end());
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::ranges::nth_element(sorted, middle);
    return {VectorXd::Zero(features_.cols()), *middle};
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
    const Index rank = features_.cols();
    if (rows == 0) {
        direction_ = -gradient_;
        bias_direction_ = -bias_gradient_ / (1e-3 * curvature);
        return;
    }
    bent_.setZero(padded(rank), rows);
    for (Index k = 0; k < rows; ++k) {
        bent_.col(k).head(rank) = by_row_.col(bending_[static_cast<std::size_t>(k)]);
    }
    if (rows > rank) {
        direction_in_feature_space(curvature);
    } else {
        direction_in_row_space(curvature);
    }
}

void TubeSolver::direction_in_feature_space(double curvature) {
    const Index rank = features_.cols();
    const VectorXd mean = bent_.rowwise().mean();
    bent_.colwise() -= mean;
    auto system = square_of(bent_, rank);
    system *= curvature;
    system.diagonal().array() += 1.0;
    const Eigen::LLT<Eigen::Ref<MatrixXd>> factor(system);
    direction_ = factor.solve(mean.head(rank) * bias_gradient_ - gradient_);
    bias_direction_ =
        -bias_gradient_ / (curvature * static_cast<double>(bent_.cols())) - mean.head(rank).dot(direction_);
}

void TubeSolver::direction_in_row_space(double curvature) {
    const Index rank = features_.cols();
    const Index rows = bent_.cols();
    bring_row_gram_up_to_date();
    square_ = row_gram_;
    square_.diagonal().array() += 1.0 / curvature;
    Eigen::Ref<MatrixXd> system(square_);
    const Eigen::LLT<Eigen::Ref<MatrixXd>> factor(system);
    const auto bent = bent_.topRows(rank);
    const VectorXd without_bias = factor.solve(-(bent.transpose() * gradient_));
    const VectorXd of_bias = factor.solve(VectorXd::Ones(rows));
    bias_direction_ = (-bias_gradient_ - without_bias.sum()) / of_bias.sum();
    direction_ = -gradient_ - bent * (without_bias + bias_direction_ * of_bias);
}

/// The inner products of the bending rows, lower triangle. From one step to the next few rows begin or cease
/// to bend: the products of those that stay are kept.
void TubeSolver::bring_row_gram_up_to_date() {
    const Index rank = features_.cols();
    const auto rows = static_cast<Index>(bending_.size());
    kept_.clear();
    fresh_.clear();
    for (Index k = 0, old = 0; k < rows; ++k) {
        const Index row = bending_[static_cast<std::size_t>(k)];
        while (old < static_cast<Index>(gram_rows_.size()) && gram_rows_[static_cast<std::size_t>(old)] < row)
            ++old;
        const bool stays =
            old < static_cast<Index>(gram_rows_.size()) && gram_rows_[static_cast<std::size_t>(old)] == row;
        if (stays) {
            kept_.emplace_back(k, old);
        } else {
            fresh_.push_back(k);
        }
    }
    if (2 * fresh_.size() > bending_.size()) {
        by_feature_.setZero(padded(rows), rank);
        by_feature_.topRows(rows) = bent_.topRows(rank).transpose();
        row_gram_ = square_of(by_feature_, rows);
    } else {
        new_gram_.resize(rows, rows);
        for (const auto& [column, old_column] : kept_) {
            for (const auto& [row, old_row] : kept_) {
                if (row >= column) new_gram_(row, column) = row_gram_(old_row, old_column);
            }
        }
        const auto bent = bent_.topRows(rank);
        for (const Index k : fresh_) {
            const VectorXd products = bent.transpose() * bent.col(k);
            new_gram_.row(k).head(k + 1) = products.head(k + 1).transpose();
            new_gram_.col(k).tail(rows - k) = products.tail(rows - k);
        }
        std::swap(row_gram_, new_gram_);
    }
    gram_rows_ = bending_;
}

/// The lower triangle of the sum of v v' over the columns v of `vectors`, without the padding.
Eigen::Ref<MatrixXd> TubeSolver::square_of(const MatrixXd& vectors, Index length) {
    square_.setZero(vectors.rows(), vectors.rows());
    vector_loops::add_outer_products(vectors.data(), static_cast<std::size_t>(vectors.rows()),
                                     static_cast<std::size_t>(vectors.cols()), square_.data());
    return square_.topLeftCorner(length, length);
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
