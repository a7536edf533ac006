#pragma once

#include <vector>

#include <Eigen/Core>

#include "channel_model.hpp"

namespace thermbal {

/// A channel as the search for the common mixture sees it: y = c (mean + differences g) + N(0, covariance).
struct RespondingChannel {
    Eigen::VectorXd value;
    Eigen::MatrixXd covariance;  ///< of everything but the archived responses
    Eigen::MatrixXd responses;   ///< columns in the frame of `value`: the mean, then each test's difference
    double scale_C = 1.0;
};

/// `responses` as in BackgroundPrior; `modes`, at `mode_scale_C`, are what no earlier test had. A channel
/// without responses stays empty.
RespondingChannel responding_channel(const ReducedChannel& data, const Basis& basis,
                                     const BackgroundPrior& background, const Eigen::MatrixXd& responses,
                                     double scale_C, double mode_scale_C, const ModePrior& modes);

/// What the other channels say about the mixture g of a channel.
struct MixtureBelief {
    Eigen::VectorXd mean;
    Eigen::MatrixXd covariance;
};

/// One heat split and one speed mix the earlier tests' responses alike on every channel: g is estimated from
/// all channels but the one asked for (so that no sample counts twice), each channel's scale c free.
/// Gauss-Newton; channels without responses get an empty belief. All channels have the same number of
/// differences.
std::vector<MixtureBelief> common_mixture(const std::vector<RespondingChannel>& channels,
                                          const MixtureOptions& options);

/// The responses as the belief leaves them: the mean moved to where the mixture lies, then one column for
/// each direction it may still go, scaled to a standard deviation of 1.
Eigen::MatrixXd moved_responses(const Eigen::MatrixXd& responses, const MixtureBelief& belief);

}  // namespace thermbal
