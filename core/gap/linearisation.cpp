#include "linearisation.hpp"

namespace thermbal {

Linearisation::Linearisation(const Fit& fit)
    : fit_(&fit),
      samples_(fit.jacobian.rows() - fit.jacobian.cols()),
      hessian_(fit.hessian),
      log_determinant_(hessian_.vectorD().array().abs().log().sum()),
      // A fit that stopped short of its optimum must not look like something missing.
      residual_(fit.point.residual.head(samples_) -
                fit.jacobian.topRows(samples_) *
                    hessian_.solve(fit.jacobian.transpose() * fit.point.residual)) {}

Eigen::MatrixXd Linearisation::project(const Eigen::MatrixXd& whitened) const {
    const auto sensitivities = fit_->jacobian.topRows(samples_);
    return whitened - sensitivities * hessian_.solve(sensitivities.transpose() * whitened);
}

Linearisation::Gain Linearisation::gain_of(const Eigen::VectorXd& whitened_change) const {
    const Eigen::VectorXd imitable = fit_->jacobian.topRows(samples_).transpose() * whitened_change;
    // d' (I - J H^-1 J') d: what is left of the change's weight, the priors' resistance included.
    const double left = whitened_change.squaredNorm() - imitable.dot(hessian_.solve(imitable));
    if (left < 1e-9 * whitened_change.squaredNorm() || left <= 0.0) return {};
    const double score = whitened_change.dot(residual());
    return {score / left, 0.5 * score * score / left};
}

}  // namespace thermbal
