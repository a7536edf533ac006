#pragma once

#include <vector>

#include <Eigen/Core>

#include "design.hpp"
#include "mode_sampler.hpp"
#include "random.hpp"

namespace thermbal {

/// Priors of what is not a mode: the level, the response to the room, and a faint continuous background of
/// time constants that stands for the many small modes of a body. All Gaussian, so they are marginalised
/// exactly.
struct BackgroundPrior {
    Eigen::VectorXd
        level_profile;  ///< of the background, per time constant of the basis, relative to scale squared
    Eigen::VectorXd ambient_mean;  ///< empty without an ambient
    Eigen::VectorXd ambient_variance;
    /// Archived responses of the channel, one a column, on the background's grid and then the modes'; empty
    /// without. The first (settling at 1) has a free multiple, each of the others one of the channel's scale
    /// (sd).
    Eigen::MatrixXd responses;
    double ambient_gain_loss_per_C = 0.0;
    double ambient_gain_sd = 0.05;
};

/// Archived responses in the rotated frame of a channel's samples, one a column.
Eigen::MatrixXd response_rows(const ReducedChannel& channel, const Basis& basis,
                              const Eigen::MatrixXd& responses);

/// A steady state, or another linear function of the coefficients, given one state of the modes.
struct ConditionalValue {
    double mean = 0.0;
    double variance = 0.0;
};

/// One channel's Gaussian model in the rotated frame of its samples.
class ChannelModel {
  public:
    /// `scale` is what the channel moves, `mode_scale` what its modes carry of it (less, with archived
    /// responses).
    ChannelModel(const ReducedChannel& channel, const Basis& basis, const BackgroundPrior& prior,
                 double scale, double mode_scale, const Eigen::VectorXd& functional);

    /// What the mode sampler needs.
    WhitenedChannel whitened(double direction) const;

    /// Sets the modes everything below is conditional on: rotated step columns and the prior of the
    /// amplitudes.
    void condition_on(const Eigen::MatrixXd& columns, const ModeAmplitudes& amplitudes);

    /// The rows' value and covariance, modes left out.
    const Eigen::VectorXd& value() const { return value_; }
    const Eigen::MatrixXd& covariance() const { return background_covariance_; }

    Eigen::MatrixXd columns_at(const std::vector<Mode>& modes) const;
    ConditionalValue steady_state() const;
    Eigen::VectorXd mean_background() const;  ///< coefficients of the basis, then of the archived responses
    Eigen::VectorXd mean_modes() const;       ///< amplitudes of the modes
    double settled(const Eigen::VectorXd& sample) const;  ///< steady state of a draw
    /// One draw of all coefficients (basis, archived responses, modes) by Matheron's rule.
    Eigen::VectorXd draw(Random& random) const;

  private:
    Eigen::MatrixXd rows_;
    Eigen::MatrixXd fine_;
    Eigen::VectorXd value_;
    Eigen::VectorXd noise_variance_;
    Eigen::VectorXd prior_mean_;
    Eigen::VectorXd prior_variance_;
    Eigen::VectorXd functional_;
    Eigen::MatrixXd background_covariance_;  // of the rows, noise included
    Eigen::VectorXd cross_;                  // covariance of the rows with the functional, background only
    double functional_variance_ = 0.0;
    double functional_mean_ = 0.0;
    double scale_squared_ = 1.0;

    Eigen::MatrixXd columns_;
    Eigen::VectorXd mode_variance_;
    Eigen::VectorXd mode_mean_;
    Eigen::VectorXd left_;    // value less what the modes' prior means explain
    Eigen::MatrixXd factor_;  // lower triangle
    Eigen::VectorXd dual_;    // covariance^-1 (value - prior mean)
};

}  // namespace thermbal
