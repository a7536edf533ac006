#include "fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

namespace thermbal {
namespace {

/// The damped step from a point, with coordinates that a bound stops left out.
Eigen::VectorXd damped_step(const Eigen::MatrixXd& hessian, const Eigen::VectorXd& gradient,
                            const Eigen::VectorXd& at, const Eigen::VectorXd& lower,
                            const Eigen::VectorXd& upper, double damping) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(at.size());
    std::vector<bool> held(static_cast<std::size_t>(at.size()), false);
    for (int round = 0; round < 4; ++round) {
        std::vector<Eigen::Index> free;
        for (Eigen::Index i = 0; i < at.size(); ++i) {
            if (!held[static_cast<std::size_t>(i)]) free.push_back(i);
        }
        Eigen::MatrixXd reduced = hessian(free, free);
        Eigen::VectorXd slope = gradient(free);
        for (Eigen::Index i = 0; i < at.size(); ++i) {
            if (held[static_cast<std::size_t>(i)]) slope += hessian(free, i) * step(i);
        }
        reduced.diagonal() += damping * reduced.diagonal().cwiseMax(1e-9);
        const Eigen::VectorXd moved = -reduced.ldlt().solve(slope);
        bool stopped = false;
        for (std::size_t k = 0; k < free.size(); ++k) {
            const Eigen::Index i = free[k];
            const double target = std::clamp(at(i) + moved(static_cast<Eigen::Index>(k)), lower(i), upper(i));
            step(i) = target - at(i);
            if (target == lower(i) || target == upper(i)) {
                held[static_cast<std::size_t>(i)] = true;
                stopped = true;
            }
        }
        if (!stopped) break;
    }
    return step;
}

/// Sensitivities of all coordinates that `known` does not hold.
Result<Eigen::MatrixXd> jacobian_at(const FitProblem& problem, const FitPoint& point, const FitStart& start) {
    Eigen::MatrixXd jacobian(point.residual.size(), problem.dimensions());
    const auto base = start.known_jacobian == nullptr ? 0 : start.known_jacobian->cols();
    const Eigen::Index nuisances = problem.data().nuisances();
    const Eigen::Index effects = problem.dimensions() - nuisances;
    const Eigen::Index samples = point.residual.size() - problem.dimensions();
    for (Eigen::Index i = 0; i < problem.dimensions(); ++i) {
        // A known Jacobian has the parameters of the smaller model, then the nuisances; its rows end with as
        // many priors.
        const Eigen::Index twin = i >= effects ? base - nuisances + (i - effects) : i;
        if (start.known_jacobian != nullptr && (i >= effects || i < base - nuisances)) {
            jacobian.col(i).setZero();
            jacobian.col(i).head(samples) = start.known_jacobian->col(twin).head(samples);
            jacobian(samples + i, i) = (*start.known_jacobian)(samples + twin, twin);
            continue;
        }
        auto column = problem.sensitivity(point, i);
        if (!column) return std::unexpected(column.error());
        jacobian.col(i) = *column;
    }
    return jacobian;
}

}  // namespace

Result<Fit> minimise(const FitProblem& problem, const FitStart& start, const CalibrationOptions& options) {
    const Eigen::VectorXd lower = problem.lower(), upper = problem.upper();
    auto first = problem.evaluate(start.coordinates.cwiseMax(lower).cwiseMin(upper));
    if (!first) return std::unexpected(first.error());
    Fit fit{{}, problem.parameters(), std::move(*first), {}, 0, false};
    double damping = 1e-3;
    auto jacobian = jacobian_at(problem, fit.point, start);
    if (!jacobian) return std::unexpected(jacobian.error());
    fit.jacobian = std::move(*jacobian);
    while (fit.iterations < options.max_iterations && !fit.converged) {
        ++fit.iterations;
        const Eigen::MatrixXd hessian = fit.hessian();
        const Eigen::VectorXd gradient = fit.jacobian.transpose() * fit.point.residual;
        bool better = false;
        for (int attempt = 0; attempt < 8 && !better; ++attempt) {
            const Eigen::VectorXd step =
                damped_step(hessian, gradient, fit.point.coordinates, lower, upper, damping);
            const double promised = -step.dot(2.0 * gradient + hessian * step);
            auto next = problem.evaluate(fit.point.coordinates + step);
            if (next && next->chi2 < fit.point.chi2) {
                better = true;
                fit.converged = fit.point.chi2 - next->chi2 < options.chi2_tolerance;
                fit.point = std::move(*next);
                damping = std::max(damping * 0.1, 1e-9);
            } else if (promised < options.chi2_tolerance) {
                fit.converged = true;
                break;
            } else {
                damping = std::max(damping, 1e-4) * 8.0;
            }
        }
        if (!better) {
            fit.converged = true;
            break;
        }
        if (fit.converged) break;
        jacobian = jacobian_at(problem, fit.point, start);
        if (!jacobian) return std::unexpected(jacobian.error());
        fit.jacobian = std::move(*jacobian);
    }
    fit.model = problem.model_at(fit.point.coordinates);
    return fit;
}

}  // namespace thermbal
