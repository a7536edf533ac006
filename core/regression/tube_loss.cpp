#include "tube_loss.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace thermbal {

/// Safeguarded Newton to a slope a fifth of the first.
double length_of_step(const StepShape& shape, const Eigen::VectorXd& residuals, const Eigen::VectorXd& change,
                      const vector_loops::Tube& tube) {
    if (!(shape.first_slope < 0.0)) return 0.0;
    const double enough = 0.2 * std::abs(shape.first_slope);
    double low = 0.0;
    double high = std::numeric_limits<double>::infinity();
    double t = 1.0;
    for (int trial = 0; trial < 60; ++trial) {
        const auto loss = vector_loops::derivatives_along(residuals.data(), change.data(), t,
                                                          static_cast<std::size_t>(residuals.size()), tube);
        const double slope = shape.along + t * shape.square - loss.first;
        if (std::abs(slope) <= enough) break;
        (slope < 0.0 ? low : high) = t;
        const double next = t - slope / (shape.square + loss.second);
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

double move_to_middle(const Eigen::VectorXd& residuals, const Eigen::VectorXd& slopes, double epsilon) {
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    for (Eigen::Index i = 0; i < residuals.size(); ++i) {
        const double to_upper_edge = residuals(i) - epsilon;
        const double to_lower_edge = residuals(i) + epsilon;
        if (slopes(i) == 0.0) lowest = std::max(lowest, to_upper_edge);
        if (slopes(i) < 0.0) lowest = std::max(lowest, to_lower_edge);
        if (slopes(i) == 0.0) highest = std::min(highest, to_lower_edge);
        if (slopes(i) > 0.0) highest = std::min(highest, to_upper_edge);
    }
    if (std::isinf(lowest) || std::isinf(highest) || lowest >= highest) return 0.0;
    return 0.5 * (lowest + highest);
}

}  // namespace thermbal
