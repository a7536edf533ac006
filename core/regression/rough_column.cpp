#include "rough_column.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "race_bounds.hpp"

namespace thermbal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::size_t rough_rows = 400;
constexpr double rough_tolerance_factor = 100.0;
constexpr double rough_truncation_share = 0.3;
constexpr std::array first_smoothings{0.03, 0.003};
constexpr double next_folds_smoothing = 0.01;
/// Up to so much noise, or with so few lags, an error may fall again after it has grown with C (README.md).
constexpr double weak_noise_in_epsilons = 10.0;
constexpr std::size_t few_lags = 10;
int most_lost_in_a_row(double noise_in_epsilons, std::size_t lags) {
    return noise_in_epsilons > weak_noise_in_epsilons && lags > few_lags ? 1 : 3;
}

/// A tenth of the error to beat, as far as that is known.
double rough_smoothing(double rmse, double widest) {
    return std::clamp(0.1 * rmse, 3e-4, widest);
}

/// The first fold at the solver's C, smoothing by smoothing.
struct RoughFit {
    double rmse = 0.0;
    double lowest_rmse = 0.0;
};
RoughFit fit_roughly(HeldOutFold& fold, double last_smoothing) {
    const double before = fold.rmse_at(first_smoothings[0]);
    if (first_smoothings[1] > last_smoothing) static_cast<void>(fold.rmse_at(first_smoothings[1]));
    const double rmse = fold.rmse_at(last_smoothing);
    return {rmse, lowest_rmse(rmse, before, last_smoothing)};
}

/// By as many folds as both have.
bool is_above(const std::vector<double>& a, const std::vector<double>& b) {
    const std::size_t common = std::min(a.size(), b.size());
    const auto square_sum = [common](const std::vector<double>& rmse) {
        return std::inner_product(rmse.begin(), rmse.begin() + static_cast<std::ptrdiff_t>(common),
                                  rmse.begin(), 0.0);
    };
    return square_sum(a) > square_sum(b);
}

TubeSolver::State padded(TubeSolver::State state, Index rank) {
    if (state.weights.size() < rank) state.weights.conservativeResizeLike(VectorXd::Zero(rank));
    return state;
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

Result<std::vector<SigmaCandidate>> RoughColumn::look_at_first_fold(double best_mean_mse, bool skip_hopeless,
                                                                    const Cancelled& cancelled) {
    const double tolerance = rough_tolerance_factor * feature_tolerance(sigma_);
    fitted_ = std::make_unique<FoldsOnFeatures>(kernel_features(problem_, sigma_, tolerance, stride_), folds_,
                                                targets_, options_.epsilon);
    HeldOutFold& first = (*fitted_)[0];
    const double hopeless = hopeless_rmse(best_mean_mse, folds_.size());
    TubeSolver::State state = first.solver().cold_start();
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
        first.start(C, state);
        const RoughFit fit =
            fit_roughly(first, rough_smoothing(std::sqrt(best_mean_mse), first_smoothings[1]));
        state = first.solver().state();
        const VectorXd& coefficients = first.solver().coefficients();
        largest_coefficient = coefficients.lpNorm<Eigen::Infinity>();
        const bool grows = !candidates.empty() && fit.rmse > candidates.back().rough_rmse;
        candidates.push_back({.sigma_index = sigma_index_,
                              .C_index = k,
                              .rough_rmse = fit.rmse,
                              .lowest_rmse = fit.lowest_rmse,
                              .coefficient_sum = coefficients.lpNorm<1>(),
                              .rough_mean_mse = 0.0,
                              .rough_states = {state}});
        if (skip_hopeless && grows && fit.rmse > hopeless) break;
    }
    kernel_ = fitted_->take_kernel();
    fitted_.reset();
    return candidates;
}

Result<RoughRanking> RoughColumn::rank_by_all_folds(double noise_rmse, double least_mse,
                                                    const Cancelled& cancelled) {
    const double finest = rough_tolerance_factor * feature_tolerance(sigma_);
    const double smoothing = rough_smoothing(noise_rmse, next_folds_smoothing);
    KernelFactorisation factorisation(problem_, sigma_, stride_);
    double tolerance = std::numeric_limits<double>::infinity();
    // At most C a row; afterwards none grows by more than C does.
    double largest_sum = options_.C_grid.front() * static_cast<double>(problem_.rows());
    SigmaCandidate fit;
    fit.sigma_index = sigma_index_;
    RoughRanking ranking{.candidates = {}, .least_mean_mse = std::numeric_limits<double>::infinity()};
    const int most_lost = most_lost_in_a_row(noise_rmse / options_.epsilon, problem_.lags);
    int lost_in_a_row = 0;
    std::vector<double> before;
    for (std::size_t k = 0; k < options_.C_grid.size() && lost_in_a_row < most_lost; ++k) {
        if (cancelled()) return sweep_cancelled();
        const double needed = truncation(rough_truncation_share, noise_rmse, largest_sum, finest);
        if (needed < tolerance) {
            tolerance = needed;
            fitted_ = std::make_unique<FoldsOnFeatures>(factorisation.features(tolerance), folds_, targets_,
                                                        options_.epsilon);
        }
        if (k == 0) fit.rough_states = {(*fitted_)[0].solver().cold_start()};
        const double limit_mse = margin() * margin() * least_mse;
        fit.C_index = k;
        std::vector<double> fold_rmse = fit_all_folds(fit, smoothing, limit_mse);
        const bool lost = fit.rough_mean_mse > limit_mse;
        if (!lost) ranking.candidates.push_back(fit);
        lost_in_a_row = lost && is_above(fold_rmse, before) ? lost_in_a_row + 1 : 0;
        before = std::move(fold_rmse);
        ranking.least_mean_mse = std::min(ranking.least_mean_mse, fit.rough_mean_mse);
        least_mse = std::min(least_mse, fit.rough_mean_mse);
        if (k + 1 < options_.C_grid.size()) {
            largest_sum = fit.coefficient_sum * options_.C_grid[k + 1] / options_.C_grid[k];
        }
    }
    if (!ranking.candidates.empty()) kernel_ = fitted_->take_kernel();
    fitted_.reset();
    return ranking;
}

/// Goes on from the first of fit.rough_states. Every fold only adds to the mean: beyond the limit it is left
/// as it is. Fold by fold, the root of the mean squared error.
std::vector<double> RoughColumn::fit_all_folds(SigmaCandidate& fit, double smoothing, double limit_mse) {
    const double C = options_.C_grid[fit.C_index] * static_cast<double>(stride_);
    HeldOutFold& first = (*fitted_)[0];
    first.start(C, padded(fit.rough_states.front(), fitted_->kernel().by_row.rows()));
    fit.rough_rmse = fit_roughly(first, smoothing).rmse;
    fit.rough_states = {first.solver().state()};
    fit.coefficient_sum = first.solver().coefficients().lpNorm<1>();
    const auto count = static_cast<double>(folds_.size());
    std::vector<double> fold_rmse{fit.rough_rmse};
    double sum = fit.rough_rmse * fit.rough_rmse;
    for (std::size_t f = 1; f < folds_.size() && sum <= limit_mse * count; ++f) {
        HeldOutFold& fold = (*fitted_)[f];
        fold.start(C, fit.rough_states.front());
        if (smoothing < next_folds_smoothing) static_cast<void>(fold.rmse_at(next_folds_smoothing));
        const double rmse = fold.rmse_at(smoothing);
        sum += rmse * rmse;
        fold_rmse.push_back(rmse);
        fit.rough_states.push_back(fold.solver().state());
    }
    fit.rough_mean_mse = sum / count;
    return fold_rmse;
}

TubeSolver::State RoughColumn::on(const KernelFeatures& kernel, const TubeSolver::State& rough) const {
    const TubeSolver::State all = padded(rough, kernel_.by_row.rows());
    return {weights_of(kernel, kernel_.pivots, pivot_coefficients(kernel_, all.weights)), all.bias};
}

}  // namespace thermbal
