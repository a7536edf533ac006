#include "rough_column.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "race_bounds.hpp"

namespace thermbal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::size_t rough_rows = 400;
constexpr double rough_tolerance_factor = 100.0;
constexpr double rough_truncation_share = 0.3;
constexpr std::array first_smoothings{0.03, 0.003};
constexpr double widest_on_noise = 0.01;

/// From one C to the next, by as many folds as were fitted at both; 0 if none was.
struct Growth {
    double of_squares = 0.0;
    std::size_t folds = 0;
};
Growth growth(const std::vector<double>& from, const std::vector<double>& to) {
    const std::size_t common = std::min(from.size(), to.size());
    const auto square_sum = [common](const std::vector<double>& rmse) {
        return std::inner_product(rmse.begin(), rmse.begin() + static_cast<std::ptrdiff_t>(common),
                                  rmse.begin(), 0.0);
    };
    return {common == 0 ? 0.0 : square_sum(to) / square_sum(from), common};
}

/// When larger C are left out. Where the noise is weak or the lags are few, an error may fall again after it
/// has grown; and what a few folds say may not hold for all (README.md).
class Patience {
  public:
    Patience(double noise_in_epsilons, std::size_t lags)
        : is_short_(noise_in_epsilons > weak_noise_in_epsilons && lags > few_lags) {}

    bool is_over() const { return lost_in_a_row_ >= (is_short_ ? 2 : 3); }
    void gained() { lost_in_a_row_ = 0; }
    void lost(const Growth& growth) {
        const bool is_plain = growth.folds >= 3 && growth.of_squares > plain_growth * plain_growth;
        lost_in_a_row_ = growth.of_squares > 1.0 ? lost_in_a_row_ + (is_short_ && is_plain ? 2 : 1) : 0;
    }

  private:
    static constexpr double weak_noise_in_epsilons = 10.0;
    static constexpr std::size_t few_lags = 10;
    static constexpr double plain_growth = 1.01;

    bool is_short_;
    int lost_in_a_row_ = 0;
};

/// A tenth of the error to beat, as far as that is known.
double rough_smoothing(double rmse, double widest) {
    return std::clamp(0.1 * rmse, 3e-4, widest);
}

/// The first fold at the solver's C, from near by.
struct RoughFit {
    double rmse = 0.0;
    double lowest_rmse = 0.0;
};
RoughFit fit_roughly(HeldOutFold& fold, double last_smoothing) {
    const double before = fold.rmse_at(first_smoothings[1]);
    if (last_smoothing >= first_smoothings[1]) return {before, lowest_rmse_at_first(before, last_smoothing)};
    const double rmse = fold.rmse_at(last_smoothing);
    return {rmse, lowest_rmse(rmse, before, last_smoothing)};
}

TubeSolver::State padded(TubeSolver::State state, Index rank) {
    if (state.weights.size() < rank) state.weights.conservativeResizeLike(VectorXd::Zero(rank));
    return state;
}

/// A function by what it is made of: rows of the problem, and the coefficient of each.
struct Combination {
    std::vector<std::size_t> rows;
    std::vector<double> coefficients;
};
Combination combination_of(const DualSolver::State& state, std::size_t stride) {
    Combination function;
    for (Index k = 0; k < state.coefficients.size(); ++k) {
        if (state.coefficients(k) == 0.0) continue;
        function.rows.push_back(static_cast<std::size_t>(k) * stride);
        function.coefficients.push_back(state.coefficients(k));
    }
    return function;
}

}  // namespace

RoughColumn::RoughColumn(const LagProblem& problem, std::size_t sigma_index, const std::vector<Fold>& folds,
                         const SweepOptions& options, const VectorXd& targets)
    : problem_(problem),
      sigma_index_(sigma_index),
      sigma_(options.sigma_grid[sigma_index]),
      folds_(folds),
      options_(options),
      targets_(targets),
      stride_(std::max<std::size_t>(1, problem.rows() / rough_rows)) {}

double RoughColumn::finest_tolerance() const {
    return rough_tolerance_factor * feature_tolerance(sigma_);
}

Result<std::vector<SigmaCandidate>> RoughColumn::look_at_first_fold(double best_mean_mse, bool skip_hopeless,
                                                                    const Cancelled& cancelled) {
    FoldsOnFeatures fitted(kernel_features(problem_, sigma_, finest_tolerance(), stride_), folds_, targets_,
                           options_.epsilon);
    auto candidates = look_at_first_fold(fitted, best_mean_mse, skip_hopeless, cancelled);
    kernel_ = fitted.take_kernel();
    return candidates;
}

Result<std::vector<SigmaCandidate>> RoughColumn::look_at_first_fold(FoldsOnFeatures& fitted,
                                                                    double best_mean_mse, bool skip_hopeless,
                                                                    const Cancelled& cancelled) {
    HeldOutFold& first = fitted[0];
    const double hopeless = hopeless_rmse(best_mean_mse, folds_.size());
    const double worse = worse_rmse(best_mean_mse, folds_.size());
    int worse_in_a_row = 0;
    double largest_coefficient = std::numeric_limits<double>::infinity();
    std::vector<SigmaCandidate> candidates;
    for (std::size_t k = options_.C_grid.size(); k-- > 0;) {
        if (cancelled()) return sweep_cancelled();
        const double C = options_.C_grid[k] * static_cast<double>(stride_);
        // A C that holds no row back is the same fit as a larger one.
        if (largest_coefficient < C) {
            candidates.push_back(candidates.back());
            candidates.back().C_index = k;
            continue;
        }
        if (candidates.empty()) {
            first.start_at_least_squares(C, first_smoothings[1]);
        } else {
            first.start(C, candidates.back().rough_states.front());
        }
        const RoughFit fit =
            fit_roughly(first, rough_smoothing(std::sqrt(best_mean_mse), first_smoothings[1]));
        const VectorXd& coefficients = first.solver().coefficients();
        largest_coefficient = coefficients.lpNorm<Eigen::Infinity>();
        const bool grows = !candidates.empty() && fit.rmse > candidates.back().rough_rmse;
        candidates.push_back({.sigma_index = sigma_index_,
                              .C_index = k,
                              .rough_rmse = fit.rmse,
                              .lowest_rmse = fit.lowest_rmse,
                              .coefficient_sum = coefficients.lpNorm<1>(),
                              .rough_mean_mse = 0.0,
                              .rough_states = {first.solver().state()},
                              .rough_duals = {}});
        worse_in_a_row = grows && fit.rmse > worse ? worse_in_a_row + 1 : 0;
        const bool is_hopeless = worse_in_a_row > 1 || (grows && fit.rmse > hopeless);
        if (skip_hopeless && is_hopeless) break;
    }
    return candidates;
}

Result<RoughRanking> RoughColumn::rank_by_all_folds(double noise_rmse, double least_mse,
                                                    const Cancelled& cancelled) {
    const double finest = finest_tolerance();
    const double smoothing = rough_smoothing(noise_rmse, widest_on_noise);
    KernelFactorisation factorisation(problem_, sigma_, stride_);
    const std::size_t most_features =
        features_worth_having(problem_.rows() / stride_, first_smoothings[0], noise_rmse);
    double tolerance = std::numeric_limits<double>::infinity();
    std::unique_ptr<FoldsOnFeatures> on_features;
    std::unique_ptr<FoldsOnKernel> on_kernel;
    // At most C a row; afterwards none grows by more than C does.
    double largest_sum = options_.C_grid.front() * static_cast<double>(problem_.rows());
    SigmaCandidate fit;
    fit.sigma_index = sigma_index_;
    RoughRanking ranking{.candidates = {}, .least_mean_mse = std::numeric_limits<double>::infinity()};
    Patience patience(noise_rmse / options_.epsilon, problem_.lags);
    std::vector<double> before;
    for (std::size_t k = 0; k < options_.C_grid.size() && !patience.is_over(); ++k) {
        if (cancelled()) return sweep_cancelled();
        const double needed = truncation(rough_truncation_share, noise_rmse, largest_sum, finest);
        if (!on_kernel && !factorisation.is_within(most_features, needed)) {
            on_kernel = std::make_unique<FoldsOnKernel>(whole_kernel(problem_, sigma_, stride_), folds_,
                                                        targets_, options_.epsilon);
            if (on_features) {
                kernel_ = on_features->take_kernel();
                fit.rough_duals = {on(*on_kernel, kernel_, fit.rough_states.front())};
            } else {
                fit.rough_duals = {(*on_kernel)[0].solver().cold_start()};
            }
            fit.rough_states.clear();
        } else if (!on_kernel && needed < tolerance) {
            tolerance = needed;
            on_features = std::make_unique<FoldsOnFeatures>(factorisation.features(tolerance), folds_,
                                                            targets_, options_.epsilon);
            if (k == 0) fit.rough_states = {(*on_features)[0].solver().cold_start()};
        }
        const double limit_mse = margin() * margin() * least_mse;
        fit.C_index = k;
        std::vector<double> fold_rmse;
        if (on_kernel) {
            fold_rmse = fit_all_folds(*on_kernel, fit.rough_duals, fit, smoothing, limit_mse);
        } else {
            fit.rough_states.front() =
                padded(std::move(fit.rough_states.front()), on_features->kernel().by_row.rows());
            fold_rmse = fit_all_folds(*on_features, fit.rough_states, fit, smoothing, limit_mse);
        }
        if (fit.rough_mean_mse > limit_mse) {
            patience.lost(growth(before, fold_rmse));
        } else {
            patience.gained();
            ranking.candidates.push_back(fit);
        }
        before = std::move(fold_rmse);
        ranking.least_mean_mse = std::min(ranking.least_mean_mse, fit.rough_mean_mse);
        least_mse = std::min(least_mse, fit.rough_mean_mse);
        if (k + 1 < options_.C_grid.size()) {
            largest_sum = fit.coefficient_sum * options_.C_grid[k + 1] / options_.C_grid[k];
        }
    }
    if (on_features && !on_kernel) kernel_ = on_features->take_kernel();
    return ranking;
}

/// Goes on from the first of `states`, those of the fit. Every fold only adds to the mean: beyond the limit
/// it is left as it is. Fold by fold, the root of the mean squared error.
template <typename Folds, typename States>
std::vector<double> RoughColumn::fit_all_folds(Folds& folds, States& states, SigmaCandidate& fit,
                                               double smoothing, double limit_mse) const {
    const double C = options_.C_grid[fit.C_index] * static_cast<double>(stride_);
    auto& first = folds[0];
    first.start(C, std::move(states.front()));
    // Only the first fit of all has far to go: every other one starts from the same smoothing.
    if (fit.C_index == 0) {
        for (const double wider : first_smoothings) {
            if (wider > smoothing) static_cast<void>(first.rmse_at(wider));
        }
    }
    fit.rough_rmse = first.rmse_at(smoothing);
    states = {first.solver().state()};
    fit.coefficient_sum = first.solver().coefficients().template lpNorm<1>();
    const auto count = static_cast<double>(folds_.size());
    std::vector<double> fold_rmse{fit.rough_rmse};
    double sum = fit.rough_rmse * fit.rough_rmse;
    for (std::size_t f = 1; f < folds_.size() && sum <= limit_mse * count; ++f) {
        auto& fold = folds[f];
        fold.start(C, states.front());
        const double rmse = fold.rmse_at(smoothing);
        sum += rmse * rmse;
        fold_rmse.push_back(rmse);
        states.push_back(fold.solver().state());
    }
    fit.rough_mean_mse = sum / count;
    return fold_rmse;
}

TubeSolver::State RoughColumn::on(const FoldsOnFeatures& folds, const TubeSolver::State& rough) const {
    if (kernel_.pivots.empty()) return padded(rough, folds.kernel().by_row.rows());
    const TubeSolver::State all = padded(rough, kernel_.by_row.rows());
    return {weights_of(folds.kernel(), kernel_.pivots, pivot_coefficients(kernel_, all.weights)), all.bias};
}

TubeSolver::State RoughColumn::on(const FoldsOnFeatures& folds, const DualSolver::State& rough) const {
    const Combination function = combination_of(rough, stride_);
    return {weights_of(folds.kernel(), function.rows, function.coefficients), rough.bias};
}

DualSolver::State RoughColumn::on(const FoldsOnKernel& folds, const KernelFeatures& kernel,
                                  const TubeSolver::State& rough) {
    const TubeSolver::State all = padded(rough, kernel.by_row.rows());
    return folds.state_of(kernel.pivots, pivot_coefficients(kernel, all.weights), all.bias);
}

DualSolver::State RoughColumn::on(const FoldsOnKernel& folds, const TubeSolver::State& rough) const {
    return on(folds, kernel_, rough);
}

DualSolver::State RoughColumn::on(const FoldsOnKernel& folds, const DualSolver::State& rough) const {
    if (has_all_rows()) return rough;
    const Combination function = combination_of(rough, stride_);
    return folds.state_of(function.rows, function.coefficients, rough.bias);
}

}  // namespace thermbal
