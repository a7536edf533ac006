#include "spread.hpp"

#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

namespace thermbal {
namespace {

using Eigen::Index;

constexpr std::array spreads_tried = {0.35, 0.42, 0.5, 0.6, 0.7, 0.85, 1.0};
constexpr double log_spread_sigma = 0.5;  ///< before the run is looked at

/// The numbers whose uncertainty the model states as a share of them.
std::vector<Index> stated_numbers(const Fit& fit) {
    std::vector<Index> numbers;
    for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
        const Parameter& parameter = fit.parameters[i];
        if (!parameter.of_effect && parameter.logarithmic) numbers.push_back(static_cast<Index>(i));
    }
    return numbers;
}

/// ln of the density of the run, up to a constant, were the priors of these numbers wider by a factor.
double log_density_at(double wider, const Fit& fit, const std::vector<Index>& numbers) {
    const double change = 1.0 / (wider * wider) - 1.0;
    const Index samples = fit.jacobian.rows() - fit.jacobian.cols();
    Eigen::MatrixXd hessian = fit.hessian;
    Eigen::VectorXd slope = fit.jacobian.transpose() * fit.point.residual;
    double chi2 = fit.point.chi2;
    for (const Index i : numbers) {
        const double weight = fit.jacobian(samples + i, i), off = fit.point.residual(samples + i);
        hessian(i, i) += change * weight * weight;
        slope(i) += change * weight * off;
        chi2 += change * off * off;
    }
    const Eigen::LDLT<Eigen::MatrixXd> solver(hessian);
    chi2 -= slope.dot(solver.solve(slope));
    return -0.5 * chi2 - 0.5 * solver.vectorD().array().abs().log().sum() -
           static_cast<double>(numbers.size()) * std::log(wider);
}

void scale(Model& model, double factor) {
    for (Node& node : model.nodes) node.heat_capacity_J_per_K.relative_sigma *= factor;
    for (ThermalLink& link : model.links) link.conductance_W_per_K.relative_sigma *= factor;
    for (Source& source : model.sources) {
        source.power_W.relative_sigma *= factor;
        source.exponent.relative_sigma *= factor;
    }
}

}  // namespace

double spread_seen(const Evidence& evidence, const Fit& fit) {
    const std::vector<Index> numbers = stated_numbers(fit);
    double best = -std::numeric_limits<double>::infinity(), seen = 1.0;
    for (const double spread : spreads_tried) {
        const double surprise = std::log(spread) / log_spread_sigma;
        const double here =
            log_density_at(spread / evidence.spread, fit, numbers) - 0.5 * surprise * surprise;
        if (here <= best) continue;
        best = here;
        seen = spread;
    }
    return seen;
}

void take_for_spread(Evidence& evidence, double spread) {
    scale(evidence.prior_model, spread / evidence.spread);
    evidence.spread = spread;
}

}  // namespace thermbal
