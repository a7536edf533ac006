#pragma once

#include <Eigen/Core>

#include "fit.hpp"

namespace thermbal {

/// Sums of three neighbouring whitened readings of a channel over the root of three: independent with
/// variance one as before, a third as many. What lasts shorter than three bins is blurred: for screening, not
/// for fits. `whitened`: one column a change of the readings, its rows channel by channel, `rows` of each.
Eigen::MatrixXd pooled(const Eigen::MatrixXd& whitened, Eigen::Index rows);

/// The same fit, its readings pooled.
Fit with_pooled_readings(const Fit& fit);

}  // namespace thermbal
