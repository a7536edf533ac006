#include "gap/calibrate.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "fit.hpp"
#include "root_mean_square.hpp"

namespace thermbal {
namespace {

std::vector<CalibratedParameter> describe(const FitProblem& problem, const Fit& fit) {
    const Eigen::MatrixXd covariance =
        fit.hessian.ldlt().solve(Eigen::MatrixXd::Identity(problem.dimensions(), problem.dimensions()));
    const Eigen::VectorXd lower = problem.lower(), upper = problem.upper();
    std::vector<CalibratedParameter> described;
    for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        const double at = fit.point.coordinates(k);
        described.push_back({fit.parameters[i], fit.parameters[i].to_value(at), std::sqrt(covariance(k, k)),
                             at <= lower(k) || at >= upper(k)});
    }
    return described;
}

void state_sigmas(Model& model, const std::vector<CalibratedParameter>& parameters) {
    std::vector<double> sigmas;
    sigmas.reserve(parameters.size());
    for (const CalibratedParameter& parameter : parameters) sigmas.push_back(parameter.sigma);
    set_parameter_sigmas(model, sigmas);
}

/// The coordinates of a fit with the starts as they were read: what `simulate` computes.
Eigen::VectorXd started_as_read(const FitData& data, Eigen::VectorXd coordinates) {
    coordinates.tail(data.nuisances()).head(static_cast<Eigen::Index>(data.starts.size())).setZero();
    return coordinates;
}

}  // namespace

double CalibratedParameter::learned() const {
    if (std::isinf(parameter.prior_sigma)) return 1.0;
    const double share = sigma / parameter.prior_sigma;
    return std::max(0.0, 1.0 - share * share);
}

Result<ModelCalibration> calibrate(const Model& model, const RecordedTest& test,
                                   const CalibrationOptions& options) {
    if (const auto valid = validate(model); !valid) return std::unexpected(valid.error());
    auto data = make_fit_data(model, test, options);
    if (!data) return std::unexpected(data.error());
    data->gradients.clear();  // a model file holds none
    const FitProblem problem(*data, model);
    const auto before = problem.evaluate(problem.prior_coordinates());
    if (!before) return std::unexpected(before.error());
    const auto fit = minimise(problem, {problem.prior_coordinates(), nullptr}, options, sequential_for);
    if (!fit) return std::unexpected(fit.error());
    const auto after = problem.evaluate(started_as_read(*data, fit->point.coordinates));
    if (!after) return std::unexpected(after.error());
    ModelCalibration result;
    result.model = with_places(*fit, *data);
    result.parameters = describe(problem, *fit);
    state_sigmas(result.model, result.parameters);
    result.channels = data->seen.channels;
    result.time_s = data->seen.time_s;
    result.residual_C = after->difference_C;
    result.before_rmse_C = root_mean_square(before->difference_C);
    result.rmse_C = root_mean_square(after->difference_C);
    result.chi2 = fit->point.chi2;
    result.readings = data->whitening.readings();
    result.iterations = fit->iterations;
    result.converged = fit->converged;
    return result;
}

}  // namespace thermbal
