#include "sigma_column.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "race_bounds.hpp"

namespace thermbal {
namespace {

constexpr double fine_tolerance_factor = 10.0;
/// 32 MB.
constexpr std::size_t most_rows_of_whole_kernel = 2000;

/// What is chosen by: a smoothing moves a prediction by about as much as it is wide.
constexpr std::array smoothings{3e-4, 3e-5, 1e-6};

/// On noise narrower ones than the last change nothing (README.md). A wider one comes before them where not
/// all folds have been roughly fitted to all rows; not so wide that most rows bend.
constexpr std::array noise_smoothings{1e-3, 1e-4, 1e-5};
constexpr double widest_of_noise_race = 1e-2;
constexpr double widest_share_of_noise = 0.15;

std::vector<double> smoothings_on_noise(bool is_near, double noise_rmse) {
    std::vector<double> stages(noise_smoothings.begin(), noise_smoothings.end());
    if (is_near) return stages;
    const double widest = std::min(widest_of_noise_race, widest_share_of_noise * noise_rmse);
    if (widest < 3.0 * stages.front()) {
        stages.front() = widest;
    } else {
        stages.insert(stages.begin(), widest);
    }
    return stages;
}

/// On noise a candidate so much worse than the best one was at the same smoothing does not win. Measured on
/// 628 windows (README.md): no winner was worse by more than 0.18 of the smoothing over the noise at 1e-2,
/// 0.33 at 1e-3, 0.58 at 1e-4.
double left_behind(double smoothing, double noise_rmse) {
    const double share = smoothing >= widest_of_noise_race       ? 0.3
                         : smoothing >= noise_smoothings.front() ? 0.5
                                                                 : 0.8;
    return 1.0 + share * smoothing / noise_rmse;
}

/// Features more precise than need be cost less than new ones, if they are not many more.
bool is_worth_keeping(const KernelFeatures& kernel, double tolerance) {
    return 2 * kernel.pivots.size() <= 3 * kernel.rank_at(tolerance) + 16;
}

}  // namespace

/// A candidate's errors fold by fold as they become known.
class SigmaColumn::Race {
  public:
    Race(const SigmaCandidate& candidate, const std::vector<double>& least_rmse)
        : least_(least_rmse), rmse_(least_rmse), lowest_(least_rmse) {
        rmse_[0] = candidate.rough_rmse;
        lowest_[0] = std::max(candidate.lowest_rmse, least_[0]);
    }

    void set_start(std::size_t fold, double rmse, double smoothing) {
        rmse_[fold] = rmse;
        if (fold > 0) lowest_[fold] = std::max(lowest_rmse_at_first(rmse, smoothing), least_[fold]);
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

SigmaColumn::SigmaColumn(const LagProblem& problem, std::size_t sigma_index, const std::vector<Fold>& folds,
                         const SweepOptions& options, const Eigen::VectorXd& targets)
    : problem_(problem),
      sigma_(options.sigma_grid[sigma_index]),
      folds_(folds),
      options_(options),
      targets_(targets),
      rough_(problem, sigma_index, folds, options, targets) {}

Result<std::vector<SigmaCandidate>> SigmaColumn::look_at_first_fold(double best_mean_mse, bool skip_hopeless,
                                                                    const Cancelled& cancelled) {
    if (!rough_.has_all_rows()) return rough_.look_at_first_fold(best_mean_mse, skip_hopeless, cancelled);
    FoldsOnFeatures fitted(factorisation().features(rough_.finest_tolerance()), folds_, targets_,
                           options_.epsilon);
    return rough_.look_at_first_fold(fitted, best_mean_mse, skip_hopeless, cancelled);
}

Result<std::optional<RaceResult>> SigmaColumn::race(const SigmaCandidate& candidate, const RaceTerms& terms,
                                                    const Cancelled& cancelled) {
    Race race(candidate, terms.least_rmse);
    if (race.is_lost(terms.bound)) return std::nullopt;
    const double share = truncation_share(problem_.rows(), terms.noise_rmse / options_.epsilon);
    const double tolerance =
        truncation(share, terms.small_rmse, candidate.coefficient_sum, finest_tolerance());
    if (terms.noise_rmse > 0.0 && wants_whole_kernel(tolerance, terms.noise_rmse)) {
        if (!whole_) {
            fitted_.reset();  // A second large matrix: it is soon made again.
            whole_ = std::make_unique<FoldsOnKernel>(whole_kernel(problem_, sigma_), folds_, targets_,
                                                     options_.epsilon);
        }
        return all_folds_abreast(*whole_, candidate, race, terms, cancelled);
    }
    truncate_at(tolerance);
    return terms.noise_rmse > 0.0 ? all_folds_abreast(*fitted_, candidate, race, terms, cancelled)
                                  : first_fold_ahead(candidate, race, terms, cancelled);
}

/// What a step of smoothing does to a fold is not known before it is done: the first fold leads by one.
Result<std::optional<RaceResult>> SigmaColumn::first_fold_ahead(const SigmaCandidate& candidate, Race& race,
                                                                const RaceTerms& terms,
                                                                const Cancelled& cancelled) {
    for (std::size_t step = 0; step < smoothings.size(); ++step) {
        for (std::size_t f = 0; f < folds_.size(); ++f) {
            if (cancelled()) return sweep_cancelled();
            if (step == 0) {
                start_fold(*fitted_, f, candidate);
                race.set_start(f, (*fitted_)[f].rmse_at(smoothings.front()), smoothings.front());
                if (race.is_lost(terms.bound)) return std::nullopt;
            }
            const std::size_t next = f == 0 ? step + 1 : step;
            if (next == 0 || next == smoothings.size()) continue;
            race.set(f, (*fitted_)[f].rmse_at(smoothings[next]), smoothings[next],
                     next + 1 == smoothings.size());
            if (race.is_lost(terms.bound)) return std::nullopt;
        }
    }
    return RaceResult{race.mean_mse(), {}};
}

/// On noise most candidates are told from the best one as soon as all folds are at the same smoothing. The
/// widest is left out where every fold is there already.
template <typename Folds>
Result<std::optional<RaceResult>> SigmaColumn::all_folds_abreast(Folds& folds,
                                                                 const SigmaCandidate& candidate, Race& race,
                                                                 const RaceTerms& terms,
                                                                 const Cancelled& cancelled) {
    const std::vector<double> stages = smoothings_on_noise(rough_.has_all_rows(), terms.noise_rmse);
    RaceResult result;
    for (std::size_t stage = 0; stage < stages.size(); ++stage) {
        for (std::size_t f = 0; f < folds_.size(); ++f) {
            if (cancelled()) return sweep_cancelled();
            if (stage == 0) start_fold(folds, f, candidate);
            const double rmse = folds[f].rmse_at(stages[stage]);
            if (stage == 0) {
                race.set_start(f, rmse, stages[stage]);
            } else {
                race.set(f, rmse, stages[stage], stage + 1 == stages.size());
            }
            if (race.is_lost(terms.bound)) return std::nullopt;
        }
        result.mean_mse = race.mean_mse();
        result.by_stage.push_back(result.mean_mse);
        const double margin = left_behind(stages[stage], terms.noise_rmse);
        const bool has_rival = !terms.best_by_stage.empty();
        if (has_rival && result.mean_mse > margin * margin * terms.best_by_stage[stage]) return std::nullopt;
    }
    return result;
}

std::size_t SigmaColumn::kept_numbers() const {
    return (whole_ ? whole_->kept_numbers() : 0) + (factorisation_ ? factorisation_->kept_numbers() : 0) +
           (fitted_ ? fitted_->kept_numbers() : 0);
}

void SigmaColumn::release() {
    whole_.reset();
    fitted_.reset();
    factorisation_.reset();
}

bool SigmaColumn::has_features_for(double tolerance) const {
    return fitted_ && tolerance_ <= tolerance && is_worth_keeping(fitted_->kernel(), tolerance);
}

double SigmaColumn::finest_tolerance() const {
    return fine_tolerance_factor * feature_tolerance(sigma_);
}

KernelFactorisation& SigmaColumn::factorisation() {
    if (!factorisation_) factorisation_.emplace(problem_, sigma_);
    return *factorisation_;
}

void SigmaColumn::truncate_at(double tolerance) {
    if (has_features_for(tolerance)) return;
    fitted_.reset();
    fitted_ = std::make_unique<FoldsOnFeatures>(factorisation().features(tolerance), folds_, targets_,
                                                options_.epsilon);
    tolerance_ = tolerance;
}

bool SigmaColumn::wants_whole_kernel(double tolerance, double noise_rmse) {
    if (problem_.rows() > most_rows_of_whole_kernel || has_features_for(tolerance)) return false;
    const double widest = smoothings_on_noise(rough_.has_all_rows(), noise_rmse).front();
    return !factorisation().is_within(features_worth_having(problem_.rows(), widest, noise_rmse), tolerance);
}

/// From where the fold was roughly; where rows were left out there, the others from the first.
template <typename Folds>
void SigmaColumn::start_fold(Folds& folds, std::size_t f, const SigmaCandidate& candidate) {
    const double C = options_.C_grid[candidate.C_index];
    const bool may_have_own = f == 0 || rough_.has_all_rows();
    if (may_have_own && f < candidate.rough_states.size()) {
        folds[f].start(C, rough_.on(folds, candidate.rough_states[f]));
    } else if (may_have_own && f < candidate.rough_duals.size()) {
        folds[f].start(C, rough_.on(folds, candidate.rough_duals[f]));
    } else {
        folds[f].start(C, folds[0].solver().state());
    }
}

}  // namespace thermbal
