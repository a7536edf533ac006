#include "regression/svr.hpp"

#include <utility>

#include <Eigen/Core>

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
    for (std::size_t lag = 0; lag < lags_; ++lag) {
        for (const std::size_t row : rows) vectors_.push_back(problem.unit[row + lag]);
    }
}

double SvrModel::predict_unit(std::span<const double> newest_last) const {
    const auto count = static_cast<Eigen::Index>(coefficients_.size());
    Eigen::ArrayXd distance = Eigen::ArrayXd::Zero(count);
    for (std::size_t lag = 0; lag < lags_; ++lag) {
        const Eigen::Map<const Eigen::ArrayXd> vectors(vectors_.data() + lag * coefficients_.size(), count);
        distance += (vectors - newest_last[lag]).square();
    }
    const Eigen::Map<const Eigen::ArrayXd> coefficients(coefficients_.data(), count);
    return (coefficients * (distance * minus_inverse_sigma2_).exp()).sum() + bias_;
}

}  // namespace thermbal
