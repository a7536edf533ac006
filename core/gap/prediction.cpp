#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "explanation.hpp"

namespace thermbal {
namespace {

using Eigen::Index;

/// How many nuisances of the sensors (places, gradients) another run shares with the fit's: none when other
/// channels were measured there.
Index shared_by(const FitProblem& there, const Fit& fit, Index starts_here) {
    const Index numbers = static_cast<Index>(fit.parameters.size());
    const Index here = fit.point.coordinates.size() - numbers - starts_here;
    return here == there.data().nuisances() - static_cast<Index>(there.data().starts.size()) ? here : 0;
}

/// A fit's coordinates in another run: the model's numbers and the sensors' nuisances stay, the starts are
/// new.
Eigen::VectorXd carried_over(const FitProblem& there, const Fit& fit, Index starts_here) {
    Eigen::VectorXd coordinates = there.prior_coordinates();
    const Index numbers = static_cast<Index>(fit.parameters.size());
    const Index places = shared_by(there, fit, starts_here);
    coordinates.head(numbers) = fit.point.coordinates.head(numbers);
    coordinates.tail(places) = fit.point.coordinates.tail(places);
    return coordinates;
}

/// How uncertain those coordinates are: a factor L with covariance L L'.
Eigen::MatrixXd spread_of(const FitProblem& there, const Fit& fit, Index starts_here) {
    const Index numbers = static_cast<Index>(fit.parameters.size());
    const Index size = there.dimensions();
    const Index starts_there = static_cast<Index>(there.data().starts.size());
    const Index places = shared_by(there, fit, starts_here);
    const Eigen::MatrixXd covariance =
        fit.hessian.ldlt().solve(Eigen::MatrixXd::Identity(fit.jacobian.cols(), fit.jacobian.cols()));
    std::vector<Index> here, at;
    for (Index i = 0; i < numbers; ++i) {
        here.push_back(i);
        at.push_back(i);
    }
    for (Index i = 0; i < places; ++i) {
        here.push_back(numbers + starts_here + i);
        at.push_back(numbers + starts_there + i);
    }
    Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(size, size);
    joint(at, at) = covariance(here, here);
    for (Index i = 0; i < starts_there; ++i) {
        const double sigma_C = there.data().starts[static_cast<std::size_t>(i)].sigma_C;
        joint(numbers + i, numbers + i) = sigma_C * sigma_C;
    }
    // Numbers of very different size: rounding may leave an eigenvalue a hair below zero.
    const Eigen::LDLT<Eigen::MatrixXd> factors(joint);
    const Eigen::MatrixXd lower = factors.matrixL();
    return factors.transpositionsP().transpose() *
           (lower * factors.vectorD().cwiseMax(0.0).cwiseSqrt().asDiagonal()).eval();
}

double gaussian_log_density(const Eigen::VectorXd& residual, const Eigen::MatrixXd& sensitivity) {
    const Eigen::MatrixXd inner = Eigen::MatrixXd::Identity(sensitivity.cols(), sensitivity.cols()) +
                                  sensitivity.transpose() * sensitivity;
    const Eigen::LLT<Eigen::MatrixXd> solver(inner);
    const Eigen::VectorXd score = sensitivity.transpose() * residual;
    const Eigen::MatrixXd lower = solver.matrixL();
    return -0.5 * (residual.squaredNorm() - score.dot(solver.solve(score))) -
           lower.diagonal().array().log().sum();
}

}  // namespace

Result<Forecast> forecast(const FitData& holdout, const Evidence& evidence, const Explanation& explanation,
                          const Eigen::MatrixXd* known_sensitivity) {
    const FitProblem there(holdout, with_effects(evidence.prior_model, explanation.effects));
    const Index starts_here = static_cast<Index>(evidence.run.starts.size());
    const auto point = there.evaluate(carried_over(there, explanation.fit, starts_here));
    if (!point) return std::unexpected(point.error());
    const Index samples = point->residual.size() - there.dimensions();
    const Index numbers = static_cast<Index>(explanation.fit.parameters.size());
    const Index nuisances = there.dimensions() - numbers;
    const Index known = known_sensitivity == nullptr ? 0 : known_sensitivity->cols() - nuisances;
    Forecast result;
    result.sensitivity.resize(samples, there.dimensions());
    for (Index i = 0; i < there.dimensions(); ++i) {
        if (known_sensitivity != nullptr && (i < known || i >= numbers)) {
            result.sensitivity.col(i) = known_sensitivity->col(i < known ? i : known + i - numbers);
            continue;
        }
        const auto column = there.sensitivity(*point, i);
        if (!column) return std::unexpected(column.error());
        result.sensitivity.col(i) = column->head(samples);
    }
    const Eigen::MatrixXd spread = spread_of(there, explanation.fit, starts_here);
    result.log_density = gaussian_log_density(point->residual.head(samples), result.sensitivity * spread);
    result.point = *point;
    return result;
}

}  // namespace thermbal
