#include "sigma_column.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace thermbal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Where on the grid to look: on every few rows, C made up for them, and not to the last digit.
constexpr std::size_t rough_rows = 400;
constexpr double rough_tolerance_factor = 100.0;
constexpr std::array first_smoothings{0.03, 0.003};

/// A tenth of the error to beat, as far as that is known.
double rough_smoothing(double best_mean_mse) {
    return std::clamp(0.1 * std::sqrt(best_mean_mse), 3e-4, 3e-3);
}

/// What is chosen by: a smoothing moves a prediction by about as much as it is wide.
constexpr double fine_tolerance_factor = 10.0;
constexpr double across_folds_smoothing = 1e-2;
constexpr std::array smoothings{1e-3, 1e-4, 1e-5, 1e-6};

/// Below what a held-out error will not fall when the smoothing goes on to 0, from what the last step of
/// smoothing has done. Measured on 20 000 fits of warm-ups, noise, gaps and cycles (README.md): one in 200
/// falls lower, by a few hundredths.
double lowest_rmse(double rmse, double before, double smoothing) {
    const double without_change = rmse - 2.0 * std::abs(rmse - before) - smoothing;
    return std::max(rmse / 4.0, without_change / (1.0 + 0.45 * std::sqrt(smoothing / rmse)));
}

/// As lowest_rmse(), where no step of smoothing has been seen yet. Measured on 4662 fits (README.md): none
/// fell by more than 1.4 of the smoothing.
double lowest_rmse_across_folds(double rmse) {
    return rmse - 3.0 * across_folds_smoothing;
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

/// A candidate's errors fold by fold as they become known.
class Race {
  public:
    Race(const SigmaCandidate& candidate, const std::vector<double>& least_rmse)
        : least_(least_rmse), rmse_(least_rmse), lowest_(least_rmse) {
        rmse_[0] = candidate.rough_rmse;
        lowest_[0] = std::max(candidate.lowest_rmse, least_[0]);
    }

    void set_start(std::size_t fold, double rmse) {
        rmse_[fold] = rmse;
        if (fold > 0) lowest_[fold] = std::max(lowest_rmse_across_folds(rmse), least_[fold]);
    }
    void set(std::size_t fold, double rmse, double smoothing) {
        const double lowest = lowest_rmse(rmse, rmse_[fold], smoothing);
        lowest_[fold] = smoothing == smoothings.back() ? rmse : std::max(lowest, least_[fold]);
        rmse_[fold] = rmse;
    }

    /// Every fold only adds to the mean.
    bool is_lost(double bound) const { return mean_square(lowest_) > bound; }
    double mean_mse() const { return mean_square(rmse_); }

  private:
    static double mean_square(const std::vector<double>& values) {
        double sum = 0.0;
        for (const double value : values) sum += value * value;
        return sum / static_cast<double>(values.size());
    }

    const std::vector<double>& least_;  ///< what no candidate's error is expected to fall below
    std::vector<double> rmse_;
    std::vector<double> lowest_;
};

}  // namespace

double hopeless_rmse(double best_mean_mse, std::size_t folds) {
    return 5.0 * std::sqrt(best_mean_mse * static_cast<double>(folds));
}

SigmaColumn::SigmaColumn(const LagProblem& problem, std::size_t sigma_index, const std::vector<Fold>& folds,
                         const SweepOptions& options)
    : problem_(problem),
      sigma_index_(sigma_index),
      sigma_(options.sigma_grid[sigma_index]),
      folds_(folds),
      options_(options),
      targets_(Eigen::Map<const VectorXd>(problem.targets().data(), static_cast<Index>(problem.rows()))),
      fitted_(folds.size()) {}

Result<std::vector<SigmaCandidate>> SigmaColumn::look_for_candidates(double best_mean_mse, bool skip_hopeless,
                                                                     const Cancelled& cancelled) {
    const std::size_t stride = std::max<std::size_t>(1, problem_.rows() / rough_rows);
    rough_ = kernel_features(problem_, sigma_, rough_tolerance_factor * feature_tolerance(sigma_), stride);
    NewtonSystem system(rough_.by_row);
    HeldOutFold first(rough_, system, folds_[0], targets_, options_.epsilon);
    const double hopeless = hopeless_rmse(best_mean_mse, folds_.size());
    TubeSolver::State state = first.solver().cold_start();
    double largest_coefficient = std::numeric_limits<double>::infinity();
    std::vector<SigmaCandidate> candidates;
    for (std::size_t k = options_.C_grid.size(); k-- > 0;) {
        if (cancelled()) return sweep_cancelled();
        const double C = options_.C_grid[k] * static_cast<double>(stride);
        // A C that holds no row back is the same fit as a larger one.
        if (largest_coefficient < C) {
            candidates.push_back(candidates.back());
            candidates.back().C_index = k;
            continue;
        }
        first.start(C, state);
        const RoughFit fit = fit_roughly(first, rough_smoothing(best_mean_mse));
        state = first.solver().state();
        largest_coefficient = first.solver().coefficients().lpNorm<Eigen::Infinity>();
        const bool grows = !candidates.empty() && fit.rmse > candidates.back().rough_rmse;
        candidates.push_back({sigma_index_, k, fit.rmse, fit.lowest_rmse, state});
        if (skip_hopeless && grows && fit.rmse > hopeless) break;
    }
    return candidates;
}

Result<std::optional<double>> SigmaColumn::mean_mse(const SigmaCandidate& candidate, double bound,
                                                    const std::vector<double>& least_rmse,
                                                    const Cancelled& cancelled) {
    Race race(candidate, least_rmse);
    if (race.is_lost(bound)) return std::nullopt;
    for (std::size_t step = 0; step < smoothings.size(); ++step) {
        for (std::size_t f = 0; f < folds_.size(); ++f) {
            if (cancelled()) return sweep_cancelled();
            if (step == 0) {
                start_fold(f, candidate);
                const double error = fold(f).rmse_at(f == 0 ? smoothings.front() : across_folds_smoothing);
                race.set_start(f, error);
                if (race.is_lost(bound)) return std::nullopt;
            }
            // The first fold leads by one smoothing: what a step of smoothing does to it is not known before.
            const std::size_t next = f == 0 ? step + 1 : step;
            if (next == smoothings.size()) continue;
            race.set(f, fold(f).rmse_at(smoothings[next]), smoothings[next]);
            if (race.is_lost(bound)) return std::nullopt;
        }
    }
    return race.mean_mse();
}

std::size_t SigmaColumn::kept_numbers() const {
    if (!kernel_) return 0;
    return static_cast<std::size_t>(kernel_->by_row.size()) + system_->kept_numbers();
}

void SigmaColumn::release() {
    for (auto& fold : fitted_) fold.reset();
    system_.reset();
    kernel_.reset();
}

/// The first fold from where it was roughly, the others from the first.
void SigmaColumn::start_fold(std::size_t f, const SigmaCandidate& candidate) {
    const double C = options_.C_grid[candidate.C_index];
    fold(f).start(C, f == 0 ? on_all_rows(candidate.rough_state) : fold(0).solver().state());
}

const KernelFeatures& SigmaColumn::kernel() {
    if (!kernel_) {
        kernel_ = kernel_features(problem_, sigma_, fine_tolerance_factor * feature_tolerance(sigma_));
        system_.emplace(kernel_->by_row);
    }
    return *kernel_;
}

HeldOutFold& SigmaColumn::fold(std::size_t f) {
    if (!fitted_[f]) {
        const KernelFeatures& features = kernel();
        fitted_[f].emplace(features, *system_, folds_[f], targets_, options_.epsilon);
    }
    return *fitted_[f];
}

TubeSolver::State SigmaColumn::on_all_rows(const TubeSolver::State& rough) {
    return {weights_of(kernel(), rough_.pivots, pivot_coefficients(rough_, rough.weights)), rough.bias};
}

}  // namespace thermbal
