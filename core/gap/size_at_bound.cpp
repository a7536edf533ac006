#include "size_at_bound.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

namespace thermbal {
namespace {

using Eigen::Index;

constexpr double as_good_as_fixed = 1e-3;  ///< relative

bool stopped_at_lower_bound(const Parameter& parameter, double at) {
    return parameter.of_effect && !parameter.is_time && !parameter.logarithmic && at <= parameter.lower;
}

}  // namespace

double mean_above(double bound, double mean, double sigma) {
    const double z = (bound - mean) / sigma;
    if (z > 8.0) return bound + sigma * (1.0 / z - 2.0 / (z * z * z));  // where erfc comes to nothing
    const double density = std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
    return mean + sigma * density / (0.5 * std::erfc(z / std::numbers::sqrt2));
}

Result<Explanation> with_expected_sizes(const Evidence& evidence, const Explanation& explanation) {
    const Fit& fit = explanation.fit;
    const std::size_t known = evidence.prior_model.effects.size();
    const Eigen::VectorXd slope = fit.jacobian.transpose() * fit.point.residual;
    const Eigen::LDLT<Eigen::MatrixXd> hessian(fit.hessian);
    Explanation expected = explanation;
    bool moved = false;
    for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
        const Parameter& parameter = fit.parameters[i];
        const auto k = static_cast<Index>(i);
        const double at = fit.point.coordinates(k);
        if (!stopped_at_lower_bound(parameter, at) || parameter.effect < known) continue;
        const double variance = hessian.solve(Eigen::VectorXd::Unit(slope.size(), k))(k);
        const double size = mean_above(parameter.lower, at - variance * slope(k), std::sqrt(variance));
        for (EffectParameter& number : expected.effects[parameter.effect - known].parameters) {
            if (number.name != parameter.short_name()) continue;
            number.value = size;
            number.sigma = as_good_as_fixed * (size - parameter.lower);
        }
        expected.fit.point.coordinates(k) = size;
        moved = true;
    }
    return moved ? polish(evidence, expected) : Result<Explanation>(std::move(expected));
}

}  // namespace thermbal
