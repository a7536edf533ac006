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

/// A function sum_i c_i k(x_i, x) + bias on lagged rows. Predicts one step on the [0, 1] scale.
class SvrModel {
  public:
    /// The fit of all rows, by its support vectors.
    SvrModel(const LagProblem& problem, const SvrFit& fit, double sigma);
    /// The same function by other rows: `coefficients` one a row of `rows`.
    SvrModel(const LagProblem& problem, const std::vector<std::size_t>& rows,
             std::vector<double> coefficients, double bias, double sigma, std::size_t support_vectors);

    std::size_t lags() const { return lags_; }
    /// Of the fit, however many rows the function is written with.
    std::size_t support_vectors() const { return support_vectors_; }
    /// `newest_last`: the lags() values before the one predicted.
    double predict_unit(std::span<const double> newest_last) const;

  private:
    std::size_t lags_;
    std::size_t support_vectors_;
    double minus_inverse_sigma2_;
    double bias_;
    std::vector<double> coefficients_;  ///< padded with zeros, as the rows of vectors_
    std::vector<double> vectors_;       ///< one lag of all rows after the other
};

}  // namespace thermbal
