#include "regression/svr.hpp"

#include <Eigen/Core>

namespace thermbal {

SvrModel::SvrModel(const LagProblem& problem, const SvrFit& fit, double sigma)
    : lags_(problem.lags), minus_inverse_sigma2_(-1.0 / (sigma * sigma)), bias_(fit.bias) {
    std::vector<std::size_t> support;
    for (std::size_t row = 0; row < fit.coefficient.size(); ++row) {
        if (fit.coefficient[row] == 0.0) continue;
        support.push_back(row);
        coefficients_.push_back(fit.coefficient[row]);
    }
    for (std::size_t lag = 0; lag < lags_; ++lag) {
        for (const std::size_t row : support) vectors_.push_back(problem.unit[row + lag]);
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
