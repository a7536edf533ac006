#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "fit.hpp"

namespace thermbal {

/// What the readings do after something has begun, in a network that is linear and does not change with time:
/// whatever begins at another moment gives the same, moved.
class CourseOfReadings {
  public:
    /// `after_C`: rows the run's times, counted from the first; columns the channels. `time_s` outlives it.
    CourseOfReadings(const std::vector<double>& time_s, Eigen::MatrixXd after_C);

    /// All channels; nothing before it began, the last row behind the end.
    Eigen::RowVectorXd at(double since_s) const;
    /// The trapezoidal integral over time.
    CourseOfReadings integrated() const;
    Eigen::Index rows() const { return after_C_.rows(); }
    Eigen::Index columns() const { return after_C_.cols(); }

  private:
    const std::vector<double>* time_s_;
    Eigen::MatrixXd after_C_;
};

/// The readings' answer to heat of 1 W in a node from the beginning on, around a fit. Error: that of
/// simulate.
Result<CourseOfReadings> answer_to_heat(const FitProblem& problem, const Fit& fit, const std::string& node);

}  // namespace thermbal
