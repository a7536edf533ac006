#include "regression/svr.hpp"

#include <utility>

#include "regression/vector_loops.hpp"

namespace thermbal {
namespace {

std::vector<std::size_t> support_rows(const SvrFit& fit) {
    std::vector<std::size_t> rows;
    for (std::size_t row = 0; row < fit.coefficient.size(); ++row) {
        if (fit.coefficient[row] != 0.0) rows.push_back(row);
    }
    return rows;
}

std::vector<double> support_coefficients(const SvrFit& fit) {
    std::vector<double> coefficients;
    for (const std::size_t row : support_rows(fit)) coefficients.push_back(fit.coefficient[row]);
    return coefficients;
}

}  // namespace

SvrModel::SvrModel(const LagProblem& problem, const SvrFit& fit, double sigma)
    : SvrModel(problem, support_rows(fit), support_coefficients(fit), fit.bias, sigma,
               support_rows(fit).size()) {}

SvrModel::SvrModel(const LagProblem& problem, const std::vector<std::size_t>& rows,
                   std::vector<double> coefficients, double bias, double sigma, std::size_t support_vectors)
    : lags_(problem.lags),
      support_vectors_(support_vectors),
      minus_inverse_sigma2_(-1.0 / (sigma * sigma)),
      bias_(bias),
      coefficients_(std::move(coefficients)) {
    coefficients_.resize(vector_loops::padded(rows.size()), 0.0);
    vectors_.resize(lags_ * coefficients_.size(), 0.0);
    for (std::size_t lag = 0; lag < lags_; ++lag) {
        for (std::size_t k = 0; k < rows.size(); ++k) {
            vectors_[lag * coefficients_.size() + k] = problem.unit[rows[k] + lag];
        }
    }
}

double SvrModel::predict_unit(std::span<const double> newest_last) const {
    return bias_ + vector_loops::weighted_gaussians(vectors_.data(), coefficients_.size(),
                                                    coefficients_.data(), newest_last.data(), lags_,
                                                    minus_inverse_sigma2_);
}

}  // namespace thermbal
