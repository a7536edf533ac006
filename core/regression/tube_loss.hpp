#pragma once

#include <Eigen/Core>

#include "regression/vector_loops.hpp"

namespace thermbal {

/// A step along which the objective is taken, in the space of functions.
struct StepShape {
    double first_slope = 0.0;  ///< of the objective at its start
    double along = 0.0;        ///< function . step
    double square = 0.0;       ///< step . step
};

/// How far to go: the objective along the direction is convex and piecewise quadratic. 0 where it does not
/// fall.
double length_of_step(const StepShape& shape, const Eigen::VectorXd& residuals, const Eigen::VectorXd& change,
                      const vector_loops::Tube& tube);

/// Without a row on the edge of the tube the bias may lie anywhere between two of them; libsvm takes the
/// middle. By how much to move it from where `residuals` have these slopes; 0 where it is not bounded.
double move_to_middle(const Eigen::VectorXd& residuals, const Eigen::VectorXd& slopes, double epsilon);

}  // namespace thermbal
