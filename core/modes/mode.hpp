#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace thermbal {

/// A priori, modes are a Poisson process on the logarithm of the time constant: `intensity[g]` is the
/// expected number of modes in the cell about `log_tau[g]` (an even grid). A mode's variance, relative to a
/// channel's squared scale, is log-normal with `log_variance_mean[g]` and `log_variance_sd[g]`.
struct ModePrior {
    Eigen::VectorXd log_tau;
    Eigen::VectorXd intensity;
    Eigen::VectorXd log_variance_mean;
    Eigen::VectorXd log_variance_sd;
    Eigen::VectorXd
        same_sign;  ///< share of a mode's amplitude, rms over channels, that has the machine's direction
    std::size_t most_modes = 14;
};

/// One channel with everything but the modes marginalised: after whitening, z = U_S a + N(0, 1), where U_S
/// are columns at the modes' time constants, a ~ N(0, scale_squared * variance_k).
struct WhitenedChannel {
    Eigen::MatrixXd gram;       ///< U'U on the prior's grid
    Eigen::VectorXd projected;  ///< U'z
    double scale = 1.0;
    double direction = 0.0;  ///< +1 warming, -1 cooling, 0 (or between) if the channels disagree
};

struct Mode {
    double position = 0.0;  ///< on the prior's grid, continuous
    double log_variance = 0.0;
};

/// What a state says about each mode: variance of its amplitude and mean, relative to the channel's scale.
struct ModeAmplitudes {
    Eigen::VectorXd variance;
    Eigen::VectorXd mean;
};

/// `direction` as a channel's.
ModeAmplitudes relative_amplitudes(const std::vector<Mode>& modes, const ModePrior& prior, double direction);

/// Where a mode's position lies on an even grid.
struct GridCell {
    Eigen::Index below = 0;
    double share = 0.0;  ///< of the next point
};

GridCell cell_of(double position, Eigen::Index points);

double interpolate(const Eigen::VectorXd& values, double position);

}  // namespace thermbal
