#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "fit.hpp"

namespace thermbal {

/// The neighbourhood of a fit, where every parameter answers linearly: tells what a change of the simulation
/// would gain if all parameters were refitted with it, without refitting.
class Linearisation {
  public:
    explicit Linearisation(const Fit& fit);

    /// Takes away what the fit's own parameters can imitate. `whitened`: one column a change of the readings.
    Eigen::MatrixXd project(const Eigen::MatrixXd& whitened) const;

    struct Gain {
        double amplitude = 0.0;  ///< best multiple of the change
        double log_likelihood = 0.0;
        /// Of another amplitude: what is gained falls with the square of how far that is from the best.
        Gain at(double other) const {
            const double share = other / amplitude;
            return {other, log_likelihood * share * (2.0 - share)};
        }
    };
    /// Of adding `amplitude * change`, with every parameter free to follow.
    Gain gain_of(const Eigen::VectorXd& whitened_change) const;
    Eigen::Index samples() const { return samples_; }
    /// Whitened residual at the optimum of the linearised fit, without the priors.
    const Eigen::VectorXd& residual() const { return residual_; }
    double log_determinant() const { return log_determinant_; }

  private:
    const Fit* fit_;
    Eigen::Index samples_;
    Eigen::LDLT<Eigen::MatrixXd> hessian_;
    double log_determinant_;
    Eigen::VectorXd residual_;
};

}  // namespace thermbal
