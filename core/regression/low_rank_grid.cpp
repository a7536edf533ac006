#include "low_rank_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "regression/kernel_features.hpp"
#include "regression/tube_solver.hpp"

namespace thermbal {
namespace {

using Schedule = TubeSolver::Schedule;
using Eigen::Index;
using Eigen::VectorXd;

/// Where on the grid to look: on every few rows, C made up for them, and not to the last digit.
constexpr std::size_t rough_rows = 400;
constexpr double rough_tolerance_factor = 100.0;
/// A tenth of the error to beat, as far as that is known.
double rough_smoothing(double bound) {
    return std::clamp(0.1 * std::sqrt(bound), 3e-4, 3e-3);
}
Schedule rough_schedule(double smoothing) {
    return {.first_smoothing = 0.03, .factor = 0.1, .last_smoothing = smoothing};
}

/// What is chosen by: the smoothing moves a prediction by about as much as it is wide.
constexpr double fine_tolerance_factor = 10.0;
constexpr double fine_smoothing = 1e-7;
constexpr Schedule refine{.first_smoothing = 1e-2, .factor = 0.1, .last_smoothing = fine_smoothing};
constexpr Schedule across_folds{.first_smoothing = 0.01, .factor = 0.1, .last_smoothing = fine_smoothing};

/// For what the quicker ones did not bring to an end.
constexpr Schedule patient{
    .first_smoothing = 0.5, .factor = 0.3, .last_smoothing = fine_smoothing, .most_steps = 1000};
constexpr Schedule exact{.first_smoothing = 0.5, .factor = 0.1, .last_smoothing = 1e-8, .most_steps = 1000};

/// One fold at one sigma: a solver on its training rows, and what is held out; of the rows that the features
/// have.
class FoldFits {
  public:
    FoldFits(const KernelFeatures& kernel, const Fold& fold, const VectorXd& targets, double epsilon)
        : solver_(kernel.features(feature_rows(fold.training_rows, kernel.stride), Eigen::all),
                  targets(problem_rows(fold.training_rows, kernel.stride)), epsilon),
          held_out_(kernel.features(feature_rows(fold.held_out_rows, kernel.stride), Eigen::all)),
          held_out_targets_(targets(problem_rows(fold.held_out_rows, kernel.stride))) {}

    /// Held-out mean squared error of the fit at C, which is searched from `start`.
    double mse(double C, const TubeSolver::State& start, const Schedule& schedule) {
        if (!solver_.fit(C, start, schedule)) {
            // 1000 steps at one smoothing have not been seen to fall short; the state is the best there is in
            // any case.
            static_cast<void>(solver_.fit(C, solver_.cold_start(), patient));
        }
        const VectorXd error =
            ((held_out_ * solver_.state().weights).array() + solver_.state().bias).matrix() -
            held_out_targets_;
        return error.squaredNorm() / static_cast<double>(error.size());
    }

    const TubeSolver& solver() const { return solver_; }

  private:
    static std::vector<Index> problem_rows(const std::vector<std::size_t>& rows, std::size_t stride) {
        std::vector<Index> kept;
        for (const std::size_t row : rows) {
            if (row % stride == 0) kept.push_back(static_cast<Index>(row));
        }
        return kept;
    }

    static std::vector<Index> feature_rows(const std::vector<std::size_t>& rows, std::size_t stride) {
        std::vector<Index> kept = problem_rows(rows, stride);
        for (Index& row : kept) row /= static_cast<Index>(stride);
        return kept;
    }

    TubeSolver solver_;
    Eigen::MatrixXd held_out_;
    VectorXd held_out_targets_;
};

/// A C at the sigma in hand, after a rough fit of its first fold.
struct Candidate {
    std::size_t C_index = 0;
    double rough_mse = 0.0;
    TubeSolver::State rough_state;
};

/// A rough first fold so far above the bound that the fine one is above it, too. The margin is many times
/// what the rough fit has been seen to be off by (tests/regression compares the choice with the whole
/// grid's; 1.5 fails there).
bool is_out_of_the_running(double rough_mse, std::size_t folds, double bound) {
    const double rough_rmse = std::sqrt(rough_mse / static_cast<double>(folds));
    return rough_rmse > 4.0 * std::sqrt(bound) + rough_smoothing(bound);
}

/// Cross-validation of every C at one sigma.
class SigmaColumn {
  public:
    SigmaColumn(const LagProblem& problem, double sigma, const std::vector<Fold>& folds,
                const SweepOptions& options)
        : problem_(problem),
          sigma_(sigma),
          folds_(folds),
          options_(options),
          targets_(Eigen::Map<const VectorXd>(problem.targets().data(), static_cast<Index>(problem.rows()))),
          fits_(folds.size()) {}

    /// The first fold along C, each from the one before.
    Result<std::vector<Candidate>> look_for_candidates(double bound, const Cancelled& cancelled) {
        const std::size_t stride = std::max<std::size_t>(1, problem_.rows() / rough_rows);
        rough_ =
            kernel_features(problem_, sigma_, rough_tolerance_factor * feature_tolerance(sigma_), stride);
        FoldFits fold(rough_, folds_[0], targets_, options_.epsilon);
        const Schedule schedule = rough_schedule(rough_smoothing(bound));
        TubeSolver::State state = fold.solver().cold_start();
        std::vector<Candidate> candidates;
        for (std::size_t k = 0; k < options_.C_grid.size(); ++k) {
            if (cancelled()) return sweep_cancelled();
            // Once no row is held back by C, a larger one changes nothing.
            if (k > 0 && fold.solver().is_free_of_C()) {
                candidates.push_back({k, candidates.back().rough_mse, state});
                continue;
            }
            const double C = options_.C_grid[k] * static_cast<double>(stride);
            const double mse = fold.mse(C, state, schedule);
            state = fold.solver().state();
            candidates.push_back({k, mse, state});
        }
        return candidates;
    }

    /// The mean over folds, or nothing as soon as it is sure to be above `bound`: every fold only adds to it.
    Result<std::optional<double>> mean_mse(const Candidate& candidate, double bound,
                                           const Cancelled& cancelled) {
        if (is_out_of_the_running(candidate.rough_mse, folds_.size(), bound)) return std::nullopt;
        const double C = options_.C_grid[candidate.C_index];
        const auto count = static_cast<double>(folds_.size());
        double sum = fits(0).mse(C, on_all_rows(candidate.rough_state), refine);
        const TubeSolver::State first = fits(0).solver().state();
        for (std::size_t f = 1; f < folds_.size(); ++f) {
            if (sum / count > bound) return std::nullopt;
            if (cancelled()) return sweep_cancelled();
            sum += fits(f).mse(C, first, across_folds);
        }
        return sum / count;
    }

  private:
    const KernelFeatures& kernel() {
        if (!kernel_)
            kernel_ = kernel_features(problem_, sigma_, fine_tolerance_factor * feature_tolerance(sigma_));
        return *kernel_;
    }

    FoldFits& fits(std::size_t f) {
        if (!fits_[f]) fits_[f].emplace(kernel(), folds_[f], targets_, options_.epsilon);
        return *fits_[f];
    }

    TubeSolver::State on_all_rows(const TubeSolver::State& rough) {
        return {weights_of(kernel(), rough_.pivots, pivot_coefficients(rough_, rough.weights)), rough.bias};
    }

    const LagProblem& problem_;
    double sigma_;
    const std::vector<Fold>& folds_;
    const SweepOptions& options_;
    VectorXd targets_;
    KernelFeatures rough_;
    std::optional<KernelFeatures> kernel_;
    std::vector<std::optional<FoldFits>> fits_;
};

struct Best {
    double mean_mse = std::numeric_limits<double>::infinity();
    std::size_t sigma_index = 0;
    std::size_t C_index = 0;

    void offer(double mse, std::size_t sigma, std::size_t C) {
        const bool earlier = sigma < sigma_index || (sigma == sigma_index && C < C_index);
        if (mse < mean_mse || (mse == mean_mse && earlier)) *this = {mse, sigma, C};
    }
};

Result<void> search_column(SigmaColumn& column, std::size_t sigma_index, Best& best,
                           const Cancelled& cancelled) {
    auto candidates = column.look_for_candidates(best.mean_mse, cancelled);
    if (!candidates) return std::unexpected(candidates.error());
    std::ranges::stable_sort(*candidates, {}, &Candidate::rough_mse);
    for (const Candidate& candidate : *candidates) {
        const auto mse = column.mean_mse(candidate, best.mean_mse, cancelled);
        if (!mse) return std::unexpected(mse.error());
        if (*mse) best.offer(**mse, sigma_index, candidate.C_index);
    }
    return {};
}

}  // namespace

Result<GridChoice> search_grid_low_rank(const LagProblem& problem, const SweepOptions& options,
                                        const Cancelled& cancelled) {
    const auto folds = make_folds(problem.rows(), options.folds, options.fold_kind, options.fold_seed);
    Best best;
    // Wide kernels first: they are the cheapest and mostly hold the best point, which the others are measured
    // against.
    for (std::size_t sigma = options.sigma_grid.size(); sigma-- > 0;) {
        SigmaColumn column(problem, options.sigma_grid[sigma], folds, options);
        if (auto searched = search_column(column, sigma, best, cancelled); !searched) {
            return std::unexpected(searched.error());
        }
    }
    return GridChoice{options.C_grid[best.C_index], options.sigma_grid[best.sigma_index], best.mean_mse};
}

Result<std::vector<double>> cross_validate_low_rank(const LagProblem& problem, const SweepOptions& options,
                                                    const Cancelled& cancelled) {
    const auto folds = make_folds(problem.rows(), options.folds, options.fold_kind, options.fold_seed);
    std::vector<double> all;
    for (const double sigma : options.sigma_grid) {
        SigmaColumn column(problem, sigma, folds, options);
        const auto candidates = column.look_for_candidates(0.0, cancelled);
        if (!candidates) return std::unexpected(candidates.error());
        for (const Candidate& candidate : *candidates) {
            const auto mse = column.mean_mse(candidate, std::numeric_limits<double>::infinity(), cancelled);
            if (!mse) return std::unexpected(mse.error());
            all.push_back(**mse);
        }
    }
    return all;
}

Result<SvrModel> fit_model_low_rank(const LagProblem& problem, double C, double sigma,
                                    const SweepOptions& options) {
    const KernelFeatures kernel = kernel_features(problem, sigma, 0.01 * feature_tolerance(sigma));
    const Eigen::Map<const VectorXd> targets(problem.targets().data(),
                                             static_cast<Eigen::Index>(problem.rows()));
    TubeSolver solver(kernel.features, targets, options.epsilon);
    if (!solver.fit(C, solver.cold_start(), exact)) {
        return fail(NextStep::stop,
                    fmt::format("the fit at n = {}, C = {}, sigma = {} did not come to an end", problem.lags,
                                C, sigma));
    }
    const auto support = static_cast<std::size_t>((solver.coefficients().array() != 0.0).count());
    return SvrModel(problem, kernel.pivots, pivot_coefficients(kernel, solver.state().weights),
                    solver.state().bias, sigma, support);
}

}  // namespace thermbal
