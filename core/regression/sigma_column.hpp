#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "held_out_fold.hpp"
#include "regression/folds.hpp"
#include "regression/kernel_features.hpp"
#include "regression/lags.hpp"
#include "regression/sweep.hpp"
#include "regression/tube_solver.hpp"
#include "rough_column.hpp"

namespace thermbal {

/// What a candidate is measured against.
struct RaceTerms {
    double bound = 0.0;                     ///< the mean squared error to beat
    const std::vector<double>& least_rmse;  ///< what no error is expected to fall below, fold by fold
    double noise_rmse = 0.0;  ///< of a window of noise: about what no error falls below; 0 elsewhere
    /// Of the best candidate so far, RaceResult::by_stage.
    std::span<const double> best_by_stage{};
    /// An error that is small here: what moves predictions by a few hundredths of it does not matter. 0: as
    /// precise as can be.
    double small_rmse = 0.0;
};

/// Of a candidate that came to the end: the mean squared error over folds, at the last smoothing, and
/// on noise at each.
struct RaceResult {
    double mean_mse = 0.0;
    std::vector<double> by_stage;
};

/// Cross-validation of every C at one sigma. The arguments must outlive it; one object a thread.
class SigmaColumn {
  public:
    SigmaColumn(const LagProblem& problem, std::size_t sigma_index, const std::vector<Fold>& folds,
                const SweepOptions& options, const Eigen::VectorXd& targets);

    RoughColumn& rough() { return rough_; }

    /// RoughColumn's; where that leaves no rows out, on the first of the features of race().
    Result<std::vector<SigmaCandidate>> look_at_first_fold(double best_mean_mse, bool skip_hopeless,
                                                           const Cancelled& cancelled);

    /// Nothing as soon as the mean is sure to end above terms.bound. Error: stop when cancelled.
    Result<std::optional<RaceResult>> race(const SigmaCandidate& candidate, const RaceTerms& terms,
                                           const Cancelled& cancelled);

    /// What is kept between calls of race(), in numbers; and lets go of it: the next call makes it again.
    std::size_t kept_numbers() const;
    void release();

  private:
    double finest_tolerance() const;
    bool has_features_for(double tolerance) const;
    KernelFactorisation& factorisation();
    void truncate_at(double tolerance);
    class Race;
    Result<std::optional<RaceResult>> first_fold_ahead(const SigmaCandidate& candidate, Race& race,
                                                       const RaceTerms& terms, const Cancelled& cancelled);
    template <typename Folds>
    Result<std::optional<RaceResult>> all_folds_abreast(Folds& folds, const SigmaCandidate& candidate,
                                                        Race& race, const RaceTerms& terms,
                                                        const Cancelled& cancelled);
    bool wants_whole_kernel(double tolerance, double noise_rmse);
    template <typename Folds>
    void start_fold(Folds& folds, std::size_t f, const SigmaCandidate& candidate);

    const LagProblem& problem_;
    double sigma_;
    const std::vector<Fold>& folds_;
    const SweepOptions& options_;
    const Eigen::VectorXd& targets_;
    RoughColumn rough_;
    std::optional<KernelFactorisation> factorisation_;
    double tolerance_ = 0.0;
    std::unique_ptr<FoldsOnFeatures> fitted_;  ///< on the features down to tolerance_
    std::unique_ptr<FoldsOnKernel> whole_;     ///< or on none
};

}  // namespace thermbal
