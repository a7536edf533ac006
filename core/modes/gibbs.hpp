#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "design.hpp"
#include "modes/spectrum.hpp"

namespace thermbal {

/// Priors of the sampler, per time constant: weight ~ InverseGamma(shape, rate), where a rate of
/// `level_profile` > 0 is multiplied by the sampled base level (a machine never seen before) and a fixed rate
/// comes from an archive.
struct WeightPrior {
    Eigen::VectorXd shape;
    Eigen::VectorXd fixed_rate;
    Eigen::VectorXd level_profile;
    double level_shape = 1.0;
    double level_rate = 1.0;
    double scale_shape = 1.0;
    double scale_floor = 0.0;      ///< least scale of a channel, as a share of the median range of all
    Eigen::VectorXd ambient_mean;  ///< of the response to the room; empty without an ambient
    Eigen::VectorXd ambient_variance;
    double ambient_gain_sd = 0.05;
};

/// A linear function of a channel's coefficients, tracked through the sampling as a mixture of normals.
struct ChannelDraws {
    std::vector<double> mean;  ///< conditional mean of the steady state, one a draw
    std::vector<double> variance;
    Eigen::VectorXd coefficient_mean;
    Eigen::MatrixXd coefficients;  ///< a few draws, one a column
};

struct SpectrumDraws {
    std::vector<ChannelDraws> channels;
    Eigen::VectorXd log_weight_mean;
    Eigen::VectorXd log_weight_sd;
};

/// Samples weights, base level, scales and amplitudes in turn (all conjugate) and keeps `draws` sweeps after
/// `burn_in`. `steady_state` is the functional whose posterior is kept; `kept_coefficients` the number of
/// amplitude draws kept.
SpectrumDraws sample_spectrum(const std::vector<ReducedChannel>& channels, const Basis& basis,
                              const Eigen::VectorXd& steady_state, const WeightPrior& prior,
                              std::size_t burn_in, std::size_t draws, std::size_t kept_coefficients,
                              std::uint64_t seed);

}  // namespace thermbal
