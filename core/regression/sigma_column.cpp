#include "sigma_column.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "race_bounds.hpp"

namespace thermbal {
namespace {

constexpr double fine_tolerance_factor = 10.0;
/// Of the error to beat, what the truncation of a kernel may move a prediction by at the very most. Where the
/// rows are many, their parts of it cancel (README.md).
double truncation_share(std::size_t rows) {
    return rows < 800 ? 0.1 : 1.0;
}

/// What is chosen by: a smoothing moves a prediction by about as much as it is wide.
constexpr double across_folds_smoothing = 1e-2;
constexpr std::array smoothings{1e-3, 1e-4, 1e-5, 1e-6};

/// On noise the last step changes nothing (README.md).
std::size_t steps_of(const RaceTerms& terms) {
    return smoothings.size() - (terms.noise_rmse > 0.0 ? 1 : 0);
}

/// On noise a candidate so much worse than the best one was at the same smoothing does not win. Measured on
/// 628 windows (README.md): no winner was worse by more than 0.6 of the smoothing over the noise, 0.02 to
/// 0.18 of it where the folds have just been started.
bool is_left_behind(const std::vector<double>& by_smoothing, const RaceTerms& terms) {
    if (!(terms.noise_rmse > 0.0) || terms.best_by_smoothing.empty()) return false;
    const std::size_t stage = by_smoothing.size() - 1;
    const double moves = stage == 0 ? 0.3 * across_folds_smoothing : smoothings[stage - 1];
    const double margin = 1.0 + moves / terms.noise_rmse;
    return by_smoothing[stage] > margin * margin * terms.best_by_smoothing[stage];
}

/// As lowest_rmse(), where no step of smoothing has been seen yet. Measured on 4662 fits (README.md): none
/// fell by more than 1.4 of the smoothing.
double lowest_rmse_across_folds(double rmse) {
    return rmse - 3.0 * across_folds_smoothing;
}

/// Features more precise than need be cost less than new ones, if they are not many more.
bool is_worth_keeping(const KernelFeatures& kernel, double tolerance) {
    return 2 * kernel.pivots.size() <= 3 * kernel.rank_at(tolerance) + 16;
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
    void set(std::size_t fold, double rmse, double smoothing, bool is_last) {
        const double lowest = lowest_rmse(rmse, rmse_[fold], smoothing);
        lowest_[fold] = is_last ? rmse : std::max(lowest, least_[fold]);
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

SigmaColumn::SigmaColumn(const LagProblem& problem, std::size_t sigma_index, const std::vector<Fold>& folds,
                         const SweepOptions& options, const Eigen::VectorXd& targets)
    : problem_(problem),
      sigma_(options.sigma_grid[sigma_index]),
      folds_(folds),
      options_(options),
      targets_(targets),
      rough_(problem, sigma_index, folds, options, targets) {}

Result<std::optional<RaceResult>> SigmaColumn::race(const SigmaCandidate& candidate, const RaceTerms& terms,
                                                    const Cancelled& cancelled) {
    const std::size_t steps = steps_of(terms);
    RaceResult result;
    Race race(candidate, terms.least_rmse);
    if (race.is_lost(terms.bound)) return std::nullopt;
    truncate_at(truncation(truncation_share(problem_.rows()), terms.small_rmse, candidate.coefficient_sum,
                           fine_tolerance_factor * feature_tolerance(sigma_)));
    // On noise all folds are started before one goes on: most candidates are left behind there.
    const bool all_at_once = terms.noise_rmse > 0.0;
    for (std::size_t f = 0; f < folds_.size() && all_at_once; ++f) {
        if (cancelled()) return sweep_cancelled();
        race.set_start(f, start_fold(f, candidate));
        if (race.is_lost(terms.bound)) return std::nullopt;
    }
    result.by_smoothing.push_back(race.mean_mse());
    if (is_left_behind(result.by_smoothing, terms)) return std::nullopt;
    for (std::size_t step = 0; step < steps; ++step) {
        for (std::size_t f = 0; f < folds_.size(); ++f) {
            if (cancelled()) return sweep_cancelled();
            if (step == 0 && !all_at_once) {
                race.set_start(f, start_fold(f, candidate));
                if (race.is_lost(terms.bound)) return std::nullopt;
            }
            // The first fold leads by one smoothing: what a step of smoothing does to it is not known before.
            const std::size_t next = f == 0 ? step + 1 : step;
            if (next == steps) continue;
            race.set(f, (*fitted_)[f].rmse_at(smoothings[next]), smoothings[next], next + 1 == steps);
            if (race.is_lost(terms.bound)) return std::nullopt;
        }
        result.by_smoothing.push_back(race.mean_mse());
        if (is_left_behind(result.by_smoothing, terms)) return std::nullopt;
    }
    result.mean_mse = race.mean_mse();
    return result;
}

std::size_t SigmaColumn::kept_numbers() const {
    return (factorisation_ ? factorisation_->kept_numbers() : 0) + (fitted_ ? fitted_->kept_numbers() : 0);
}

void SigmaColumn::release() {
    fitted_.reset();
    factorisation_.reset();
}

void SigmaColumn::truncate_at(double tolerance) {
    if (fitted_ && tolerance_ <= tolerance && is_worth_keeping(fitted_->kernel(), tolerance)) return;
    if (!factorisation_) factorisation_.emplace(problem_, sigma_);
    fitted_.reset();
    fitted_ = std::make_unique<FoldsOnFeatures>(factorisation_->features(tolerance), folds_, targets_,
                                                options_.epsilon);
    tolerance_ = tolerance;
}

/// The first fold from where it was roughly, the others from the first. The error at the first smoothing.
double SigmaColumn::start_fold(std::size_t f, const SigmaCandidate& candidate) {
    const double C = options_.C_grid[candidate.C_index];
    HeldOutFold& fold = (*fitted_)[f];
    if (f == 0) {
        fold.start(C, rough_.on(fitted_->kernel(), candidate.rough_state));
        return fold.rmse_at(smoothings.front());
    }
    fold.start(C, (*fitted_)[0].solver().state());
    return fold.rmse_at(across_folds_smoothing);
}

}  // namespace thermbal
