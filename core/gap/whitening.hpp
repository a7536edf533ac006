#pragma once

#include <Eigen/Core>

#include "gap/calibrate.hpp"
#include "observation.hpp"

namespace thermbal {

/// Turns differences between measurement and simulation into numbers that are independent with variance one,
/// if they are noise plus the wander that ModelFidelity allows: the innovations of a Kalman filter for
/// "first-order process seen through white noise", channel by channel. Linear, so it serves residuals and
/// sensitivities alike; where nothing was measured the result is 0.
class Whitening {
  public:
    Whitening() = default;
    Whitening(const Observation& seen, const ModelFidelity& fidelity);

    /// rows x columns as Observation::reading_C, stacked column by column.
    Eigen::VectorXd operator()(const Eigen::MatrixXd& difference_C) const;
    /// ln of the density of such differences, channel by channel, up to a constant.
    Eigen::VectorXd log_density(const Eigen::MatrixXd& difference_C) const;
    /// ln of the determinant of the covariance.
    double log_determinant() const { return log_determinant_; }
    int readings() const { return readings_; }

  private:
    /// Row by row: the channels of a row do not wait for each other.
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Rows keep_;  ///< how much of the wander survives from the row before
    Rows gain_;
    Rows scale_;  ///< 1 / standard deviation of the innovation; 0 where nothing was measured
    double log_determinant_ = 0.0;
    int readings_ = 0;
};

}  // namespace thermbal
