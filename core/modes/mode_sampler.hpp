#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "design.hpp"

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

ModeAmplitudes relative_amplitudes(const std::vector<Mode>& modes, const ModePrior& prior, double direction);

/// Reversible-jump Metropolis-Hastings (Green 1995) over number, time constants and variances of the modes,
/// the amplitudes marginalised: birth, death, moves of one mode. Returns the states kept: every `thinning`-th
/// after `burn_in`.
std::vector<std::vector<Mode>> sample_modes(const std::vector<WhitenedChannel>& channels,
                                            const ModePrior& prior, std::size_t burn_in, std::size_t kept,
                                            std::size_t thinning, std::uint64_t seed);

}  // namespace thermbal
