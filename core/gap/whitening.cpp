#include "whitening.hpp"

#include <cmath>

namespace thermbal {

Whitening::Whitening(const Observation& seen, const ModelFidelity& fidelity)
    : keep_(seen.reading_C.rows(), seen.reading_C.cols()),
      gain_(Eigen::MatrixXd::Zero(seen.reading_C.rows(), seen.reading_C.cols())),
      scale_(Eigen::MatrixXd::Zero(seen.reading_C.rows(), seen.reading_C.cols())) {
    for (Eigen::Index column = 0; column < keep_.cols(); ++column) {
        const double wander_C = fidelity.share_of_rise * seen.range_C(column);
        double variance = wander_C * wander_C;
        for (Eigen::Index row = 0; row < keep_.rows(); ++row) {
            const auto k = static_cast<std::size_t>(row);
            const double step_s = row == 0 ? 0.0 : seen.time_s[k] - seen.time_s[k - 1];
            const double keep = std::exp(-step_s / fidelity.correlation_s);
            keep_(row, column) = keep;
            variance = keep * keep * variance + (1.0 - keep * keep) * wander_C * wander_C;
            if (!std::isfinite(seen.reading_C(row, column))) continue;
            const double noise_C = seen.sigma_C(row, column);
            const double innovation = variance + noise_C * noise_C;
            gain_(row, column) = variance / innovation;
            scale_(row, column) = 1.0 / std::sqrt(innovation);
            variance *= 1.0 - gain_(row, column);
            log_determinant_ += std::log(innovation);
            ++readings_;
        }
    }
}

Eigen::VectorXd Whitening::operator()(const Eigen::MatrixXd& difference_C) const {
    const Eigen::Index rows = difference_C.rows(), columns = difference_C.cols();
    Eigen::VectorXd white(difference_C.size());
    Eigen::VectorXd wander_C = Eigen::VectorXd::Zero(columns);
    for (Eigen::Index row = 0; row < rows; ++row) {
        for (Eigen::Index column = 0; column < columns; ++column) {
            const double expected_C = keep_(row, column) * wander_C(column);
            const bool measured = scale_(row, column) != 0.0;
            const double innovation_C = measured ? difference_C(row, column) - expected_C : 0.0;
            white(column * rows + row) = innovation_C * scale_(row, column);
            wander_C(column) = expected_C + gain_(row, column) * innovation_C;
        }
    }
    return white;
}

Eigen::VectorXd Whitening::log_density(const Eigen::MatrixXd& difference_C) const {
    const Eigen::VectorXd white = (*this)(difference_C);
    Eigen::VectorXd result(difference_C.cols());
    for (Eigen::Index column = 0; column < difference_C.cols(); ++column) {
        const auto scale = scale_.col(column).array();
        result(column) = -0.5 * white.segment(column * scale_.rows(), scale_.rows()).squaredNorm() +
                         (scale > 0.0).select(scale.max(1e-300).log(), 0.0).sum();
    }
    return result;
}

}  // namespace thermbal
