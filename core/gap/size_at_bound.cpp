#include "size_at_bound.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

namespace thermbal {
namespace {

using Eigen::Index;

constexpr double as_good_as_fixed = 1e-3;  ///< relative

/// So many standard deviations above its bound a size's mean is its mode: the bound takes 0.1 % away.
constexpr double far_from_bound = 3.0;

bool is_one_sided_size(const Parameter& parameter) {
    return parameter.of_effect && !parameter.is_time && !parameter.logarithmic && parameter.lower >= 0.0;
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
    const Eigen::LDLT<Eigen::MatrixXd> hessian(fit.hessian);
    // Where the fit would go without bounds: what is left of the other slopes counts, too, where a size may
    // be far off for next to nothing.
    const Eigen::VectorXd free =
        fit.point.coordinates - hessian.solve(fit.jacobian.transpose() * fit.point.residual);
    Explanation expected = explanation;
    bool moved = false;
    for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
        const Parameter& parameter = fit.parameters[i];
        const auto k = static_cast<Index>(i);
        const double at = fit.point.coordinates(k);
        if (!is_one_sided_size(parameter) || parameter.effect < known) continue;
        const double variance = hessian.solve(Eigen::VectorXd::Unit(free.size(), k))(k);
        if (!(variance > 0.0) || !std::isfinite(variance)) continue;
        const double sigma = std::sqrt(variance);
        if (at > parameter.lower + far_from_bound * sigma) continue;
        const double size = std::min(mean_above(parameter.lower, free(k), sigma), parameter.upper);
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
