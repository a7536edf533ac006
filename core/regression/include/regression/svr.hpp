#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/error.hpp"
#include "regression/lags.hpp"

namespace thermbal {

/// f(x) = sum_i coefficient_i k(x_i, x) + bias, |coefficient_i| <= C, sum of the coefficients 0.
struct SvrFit {
    std::vector<double> coefficient;  ///< one a training row (alpha - alpha*); 0 for rows inside the tube
    double bias = 0.0;
};

struct SvrParameters {
    double C = 1.0;
    double sigma = 1.0;
    double epsilon = 0.001;   ///< half width of the tube on the [0, 1] scale
    double tolerance = 1e-3;  ///< of the solver: libsvm's violation of the optimality conditions
};

/// 1/2 c'Kc - y'c + epsilon |c|_1, what the fit minimises; `kernel(i, j)` on the rows of the fit.
template <typename Kernel>
double dual_objective(const SvrFit& fit, std::span<const double> targets, double epsilon,
                      const Kernel& kernel) {
    double objective = 0.0;
    for (std::size_t i = 0; i < fit.coefficient.size(); ++i) {
        const double c = fit.coefficient[i];
        if (c == 0.0) continue;
        double product = 0.0;
        for (std::size_t j = 0; j < fit.coefficient.size(); ++j) {
            if (fit.coefficient[j] != 0.0) product += kernel(i, j) * fit.coefficient[j];
        }
        objective += c * (0.5 * product - targets[i]) + epsilon * (c < 0.0 ? -c : c);
    }
    return objective;
}

/// A fit on lagged rows, reduced to its support vectors. Predicts one step on the [0, 1] scale.
class SvrModel {
  public:
    SvrModel(const LagProblem& problem, const SvrFit& fit, double sigma);

    std::size_t lags() const { return lags_; }
    std::size_t support_vectors() const { return coefficients_.size(); }
    /// `newest_last`: the lags() values before the one predicted.
    double predict_unit(std::span<const double> newest_last) const;

  private:
    std::size_t lags_;
    double minus_inverse_sigma2_;
    double bias_;
    std::vector<double> coefficients_;
    std::vector<double> vectors_;  ///< lags_ x support vectors: one lag of all of them after the other
};

}  // namespace thermbal
