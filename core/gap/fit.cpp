#include "fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

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

/// J'J in half the work.
Eigen::MatrixXd gram(const Eigen::MatrixXd& jacobian) {
    Eigen::MatrixXd product = Eigen::MatrixXd::Zero(jacobian.cols(), jacobian.cols());
    product.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose());
    return product.selfadjointView<Eigen::Lower>();
}

Error fit_cancelled() {
    return {NextStep::stop, "the fit was cancelled"};
}

/// The Jacobian of a fit and what follows from it. Sensitivities that are known from a fit nearby are taken
/// as they are; the rest follows the point.
class Slope {
  public:
    Slope(const FitProblem& problem, const FitStart& start, const ParallelFor& parallel_for,
          const Cancelled& cancelled)
        : problem_(problem), parallel_for_(parallel_for), cancelled_(cancelled) {
        const Eigen::Index size = problem.dimensions(), nuisances = problem.data().nuisances();
        const Eigen::Index samples = problem.data().seen.reading_C.size();
        jacobian_ = Eigen::MatrixXd::Zero(samples + size, size);
        // A known Jacobian has the parameters of the smaller model, then the nuisances; its rows end with as
        // many priors.
        const auto known = start.known_jacobian == nullptr ? 0 : start.known_jacobian->cols() - nuisances;
        const Eigen::Index numbers = size - nuisances;
        for (Eigen::Index i = 0; i < size; ++i) {
            if (start.known_jacobian == nullptr || (i >= known && i < numbers)) {
                moving_.push_back(i);
                continue;
            }
            const Eigen::Index twin = i < known ? i : known + i - numbers;
            jacobian_.col(i).head(samples) = start.known_jacobian->col(twin).head(samples);
            jacobian_(samples + i, i) = (*start.known_jacobian)(samples + twin, twin);
        }
        hessian_ = gram(jacobian_);
    }

    Result<void> follow(const FitPoint& point) {
        std::vector<std::optional<Error>> failed(moving_.size());
        parallel_for_(moving_.size(), [&](std::size_t k) {
            if (cancelled_()) {
                failed[k] = fit_cancelled();
                return;
            }
            auto column = problem_.sensitivity(point, moving_[k]);
            if (column)
                jacobian_.col(moving_[k]) = *column;
            else
                failed[k] = column.error();
        });
        for (const auto& error : failed) {
            if (error) return std::unexpected(*error);
        }
        if (static_cast<Eigen::Index>(moving_.size()) == jacobian_.cols()) {
            hessian_ = gram(jacobian_);
            return {};
        }
        for (const Eigen::Index i : moving_) {
            hessian_.col(i).noalias() = jacobian_.transpose() * jacobian_.col(i);
            hessian_.row(i) = hessian_.col(i).transpose();
        }
        return {};
    }

    const Eigen::MatrixXd& jacobian() const { return jacobian_; }
    const Eigen::MatrixXd& hessian() const { return hessian_; }

  private:
    const FitProblem& problem_;
    const ParallelFor& parallel_for_;
    const Cancelled& cancelled_;
    std::vector<Eigen::Index> moving_;
    Eigen::MatrixXd jacobian_, hessian_;
};

/// A step that makes the fit better, and by how much of chi2 the sensitivities promised.
struct Improvement {
    FitPoint point;
    double promised;
};

/// Damped until it does; none where no step promises anything, or when cancelled. Leaves in `damping` where
/// the next begins.
std::optional<Improvement> better_step(const FitProblem& problem, const Slope& slope, const FitPoint& from,
                                       double& damping, double chi2_tolerance, const Cancelled& cancelled) {
    const Eigen::VectorXd lower = problem.lower(), upper = problem.upper();
    const Eigen::VectorXd gradient = slope.jacobian().transpose() * from.residual;
    for (int attempt = 0; attempt < 8 && !cancelled(); ++attempt) {
        const Eigen::VectorXd step =
            damped_step(slope.hessian(), gradient, from.coordinates, lower, upper, damping);
        const double promised = -step.dot(2.0 * gradient + slope.hessian() * step);
        auto next = problem.evaluate(from.coordinates + step);
        if (next && next->chi2 < from.chi2) {
            damping = std::max(damping * 0.1, 1e-9);
            return Improvement{std::move(*next), promised};
        }
        if (promised < chi2_tolerance) return {};
        damping = std::max(damping, 1e-4) * 8.0;
    }
    return {};
}

}  // namespace

Result<Fit> minimise(const FitProblem& problem, const FitStart& start, const CalibrationOptions& options,
                     const ParallelFor& parallel_for, const Cancelled& cancelled) {
    constexpr int most_steps_at_once = 8;
    auto first = problem.evaluate(start.coordinates.cwiseMax(problem.lower()).cwiseMin(problem.upper()));
    if (!first) return std::unexpected(first.error());
    Fit fit{{}, problem.parameters(), std::move(*first), {}, {}, 0, false};
    double damping = 1e-3;
    Slope slope(problem, start, parallel_for, cancelled);
    if (auto done = slope.follow(fit.point); !done) return std::unexpected(done.error());
    // Where moments of switching move with everything, more steps go nowhere.
    const int most_iterations =
        problem.steers_itself() ? std::min(options.max_iterations, 15) : options.max_iterations;
    while (fit.iterations < most_iterations && !fit.converged) {
        ++fit.iterations;
        // Sensitivities cost as much as all coordinates together, a step one simulation: as long as they
        // promise about what happens, further steps are taken with them.
        for (int steps = 0; steps < most_steps_at_once; ++steps) {
            auto step = better_step(problem, slope, fit.point, damping, options.chi2_tolerance, cancelled);
            const double gained = step ? fit.point.chi2 - step->point.chi2 : 0.0;
            if (steps == 0) fit.converged = gained < options.chi2_tolerance;
            if (!step) break;
            fit.point = std::move(step->point);
            if (gained < options.chi2_tolerance || gained < 0.5 * step->promised) break;
        }
        if (cancelled()) return std::unexpected(fit_cancelled());
        if (fit.converged) break;
        if (auto done = slope.follow(fit.point); !done) return std::unexpected(done.error());
    }
    fit.jacobian = slope.jacobian();
    fit.hessian = slope.hessian();
    fit.model = problem.model_at(fit.point.coordinates);
    return fit;
}

}  // namespace thermbal
