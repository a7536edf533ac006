#include "low_rank_grid.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "linear_floor.hpp"
#include "race_bounds.hpp"
#include "regression/kernel_features.hpp"
#include "regression/tube_solver.hpp"
#include "regression/vector_loops.hpp"
#include "sigma_column.hpp"

namespace thermbal {
namespace {

using Eigen::VectorXd;

constexpr std::size_t most_kept_numbers = 500'000;  ///< 4 MB

/// By how much a kernel may do better on a fold than the linear predictor fitted to that very fold. Measured
/// (README.md): never below 0.89.
constexpr double below_linear = 0.8;

/// A window that no linear predictor follows to so many epsilons is noise.
constexpr double noise_in_epsilons = 3.0;
/// A column is worse when its least rough error is so much above the least of all.
constexpr double worse_column = 1.03;
constexpr int most_worse_in_a_row = 2;

constexpr TubeSolver::Schedule wide{
    .first_smoothing = 0.5, .factor = 0.1, .last_smoothing = 1e-3, .most_steps = 1000};
constexpr TubeSolver::Schedule exact{
    .first_smoothing = 1e-3, .factor = 0.1, .last_smoothing = 1e-8, .most_steps = 1000};
constexpr double wide_tolerance_factor = 1000.0;
/// Noise alone has a feature a row: all of them would make the start as dear as the fit.
constexpr std::size_t rows_a_wide_feature = 3;
constexpr double exact_tolerance_factor = 0.01;
/// By more than this no prediction of the last fit is moved by the truncation of its kernel. A free run makes
/// some hundred times that of it.
constexpr double negligible_C = 1e-5;

/// The coefficients are at most C a row.
double exact_tolerance(const LagProblem& problem, double C, double sigma) {
    const double largest_sum = C * static_cast<double>(problem.rows());
    return std::clamp(negligible_C / (problem.scale.range_C * largest_sum),
                      exact_tolerance_factor * feature_tolerance(sigma), 1e-6);
}

VectorXd all_targets(const LagProblem& problem) {
    return Eigen::Map<const VectorXd>(problem.targets().data(), static_cast<Eigen::Index>(problem.rows()));
}

std::vector<Eigen::Index> all_rows(const VectorXd& targets) {
    std::vector<Eigen::Index> rows(static_cast<std::size_t>(targets.size()));
    std::iota(rows.begin(), rows.end(), Eigen::Index{0});
    return rows;
}

/// Where a fit on `kernel` may start from. While the smoothing is wide most rows bend, and a step costs the
/// square of the features: that much is done on the first of them alone. The optimum is the same from
/// wherever one comes.
TubeSolver::State near_the_optimum(const KernelFeatures& kernel, const VectorXd& targets, double C,
                                   double sigma, double epsilon) {
    const std::size_t within = kernel.rank_at(wide_tolerance_factor * feature_tolerance(sigma));
    const std::size_t most = static_cast<std::size_t>(targets.size()) / rows_a_wide_feature + 1;
    const auto few = static_cast<Eigen::Index>(vector_loops::padded(std::min(within, most)));
    const Eigen::MatrixXd first_features = kernel.by_row.topRows(few);
    NewtonSystem system(first_features);
    TubeSolver solver(system, all_rows(targets), targets, epsilon);
    static_cast<void>(solver.fit(C, solver.cold_start(), wide));
    TubeSolver::State found = solver.state();
    found.weights.conservativeResizeLike(VectorXd::Zero(kernel.by_row.rows()));
    return found;
}

/// One search of the grid. What has been found so far is what every further point is measured against.
class GridSearch {
  public:
    GridSearch(const LagProblem& problem, const SweepOptions& options, const Cancelled& cancelled)
        : options_(options),
          cancelled_(cancelled),
          targets_(all_targets(problem)),
          folds_(make_folds(problem.rows(), options.folds, options.fold_kind, options.fold_seed)),
          least_rmse_(linear_floor(problem, folds_)),
          noise_rmse_(below_linear * linear_rmse(problem)) {
        for (double& rmse : least_rmse_) rmse *= below_linear;
        for (std::size_t sigma = 0; sigma < options.sigma_grid.size(); ++sigma) {
            columns_.emplace_back(problem, sigma, folds_, options, targets_);
        }
    }

    Result<GridChoice> run() {
        if (auto looked = is_noise() ? rank_columns() : look_at_columns(); !looked) {
            return std::unexpected(looked.error());
        }
        for (const SigmaCandidate& candidate : waiting_) {
            if (auto done = cross_validate(candidate); !done) return std::unexpected(done.error());
        }
        return GridChoice{options_.C_grid[best_C_], options_.sigma_grid[best_sigma_], best_mean_mse_};
    }

  private:
    bool is_noise() const { return noise_rmse_ > noise_in_epsilons * options_.epsilon; }

    /// Where all points of the grid lie within a factor of two, a rough ranking by all folds costs less than
    /// one fold to the end. From wide kernels to narrow ones, until two in a row are worse and ever more so.
    Result<void> rank_columns() {
        double least_mse = std::numeric_limits<double>::infinity();
        double of_wider = least_mse;
        int worse_in_a_row = 0;
        for (std::size_t sigma = columns_.size(); sigma-- > 0 && worse_in_a_row < most_worse_in_a_row;) {
            auto ranking = columns_[sigma].rough().rank_by_all_folds(noise_rmse_, least_mse, cancelled_);
            if (!ranking) return std::unexpected(ranking.error());
            const bool no_candidate = ranking->candidates.empty();
            std::ranges::move(ranking->candidates, std::back_inserter(waiting_));
            const double of_this = ranking->least_mean_mse;
            least_mse = std::min(least_mse, of_this);
            const bool grows = of_this > of_wider && of_this > worse_column * worse_column * least_mse;
            const bool is_worse = grows || no_candidate;
            worse_in_a_row = is_worse ? worse_in_a_row + 1 : 0;
            of_wider = of_this;
        }
        const double margin = columns_.front().rough().margin();
        std::erase_if(waiting_, [margin, least_mse](const SigmaCandidate& candidate) {
            return candidate.rough_mean_mse > margin * margin * least_mse;
        });
        sort_waiting(&SigmaCandidate::rough_mean_mse);
        return {};
    }

    /// Wide kernels first: they are the cheapest and mostly hold the best point.
    Result<void> look_at_columns() {
        for (std::size_t sigma = columns_.size(); sigma-- > 0 && !narrower_is_hopeless();) {
            if (auto looked = look_at_column(sigma); !looked) return looked;
        }
        sort_waiting(&SigmaCandidate::rough_rmse);
        return {};
    }

    /// The most promising point so far is cross-validated at once: a low bound saves the most.
    Result<void> look_at_column(std::size_t sigma) {
        auto found = columns_[sigma].look_at_first_fold(best_mean_mse_, true, cancelled_);
        if (!found) return std::unexpected(found.error());
        const auto least = std::ranges::min_element(*found, {}, &SigmaCandidate::rough_rmse);
        least_by_column_.push_back(least->rough_rmse);
        const bool is_least = least->rough_rmse <= std::ranges::min(least_by_column_);
        std::ranges::copy_if(*found, std::back_inserter(waiting_), [&](const SigmaCandidate& candidate) {
            return !is_least || &candidate != &*least;
        });
        return is_least ? cross_validate(*least) : Result<void>{};
    }

    /// A kernel narrower than the data's own scale gets worse with every further step.
    bool narrower_is_hopeless() const {
        if (least_by_column_.size() < 2) return false;
        const double last = least_by_column_.back();
        return last > hopeless_rmse(best_mean_mse_, folds_.size()) &&
               last > least_by_column_[least_by_column_.size() - 2];
    }

    /// Column by column, so that none is made twice where not all can be kept; the most promising first.
    void sort_waiting(double SigmaCandidate::* promise) {
        std::vector<double> least(columns_.size(), std::numeric_limits<double>::infinity());
        for (const SigmaCandidate& candidate : waiting_) {
            double& of_column = least[candidate.sigma_index];
            of_column = std::min(of_column, candidate.*promise);
        }
        std::ranges::stable_sort(waiting_, {}, [&](const SigmaCandidate& candidate) {
            return std::tuple(least[candidate.sigma_index], candidate.sigma_index, candidate.*promise);
        });
    }

    Result<void> cross_validate(const SigmaCandidate& candidate) {
        let_go_of_others(candidate.sigma_index);
        const auto raced =
            columns_[candidate.sigma_index].race(candidate, terms_against(candidate), cancelled_);
        if (!raced) return std::unexpected(raced.error());
        if (*raced) offer(**raced, candidate.sigma_index, candidate.C_index);
        return {};
    }

    /// Noise alone makes many features, and forgives few. Before anything is to be beaten: the first fold
    /// alone makes so much of the mean.
    RaceTerms terms_against(const SigmaCandidate& candidate) const {
        const double of_first = candidate.rough_rmse / std::sqrt(static_cast<double>(folds_.size()));
        return {.bound = best_mean_mse_,
                .least_rmse = least_rmse_,
                .noise_rmse = is_noise() ? noise_rmse_ : 0.0,
                .best_by_stage = best_by_stage_,
                .small_rmse = is_noise() ? std::min(std::sqrt(best_mean_mse_), of_first) : 0.0};
    }

    /// Rough windows have kernels of a rank in the hundreds: all columns together would take a gigabyte.
    void let_go_of_others(std::size_t used) {
        std::size_t kept = 0;
        for (const SigmaColumn& column : columns_) kept += column.kept_numbers();
        if (kept <= most_kept_numbers) return;
        for (std::size_t sigma = 0; sigma < columns_.size(); ++sigma) {
            if (sigma != used) columns_[sigma].release();
        }
    }

    void offer(const RaceResult& raced, std::size_t sigma, std::size_t C) {
        const double mean_mse = raced.mean_mse;
        const bool earlier = sigma < best_sigma_ || (sigma == best_sigma_ && C < best_C_);
        if (mean_mse > best_mean_mse_ || (mean_mse == best_mean_mse_ && !earlier)) return;
        best_mean_mse_ = mean_mse;
        best_by_stage_ = raced.by_stage;
        best_sigma_ = sigma;
        best_C_ = C;
    }

    const SweepOptions& options_;
    const Cancelled& cancelled_;
    VectorXd targets_;
    std::vector<Fold> folds_;
    std::vector<double> least_rmse_;  ///< fold by fold
    double noise_rmse_;               ///< of the window: no error falls much below it
    std::vector<SigmaColumn> columns_;
    std::vector<SigmaCandidate> waiting_;
    std::vector<double> least_by_column_;  ///< from the widest kernel on
    double best_mean_mse_ = std::numeric_limits<double>::infinity();
    std::vector<double> best_by_stage_;
    std::size_t best_sigma_ = 0;
    std::size_t best_C_ = 0;
};

}  // namespace

Result<GridChoice> search_grid_low_rank(const LagProblem& problem, const SweepOptions& options,
                                        const Cancelled& cancelled) {
    return GridSearch(problem, options, cancelled).run();
}

Result<std::vector<double>> cross_validate_low_rank(const LagProblem& problem, const SweepOptions& options,
                                                    const Cancelled& cancelled) {
    constexpr double no_bound = std::numeric_limits<double>::infinity();
    const auto folds = make_folds(problem.rows(), options.folds, options.fold_kind, options.fold_seed);
    const std::vector<double> nothing_expected(folds.size());
    const RaceTerms everything{.bound = no_bound, .least_rmse = nothing_expected};
    const VectorXd targets = all_targets(problem);
    std::vector<double> all;
    for (std::size_t sigma = 0; sigma < options.sigma_grid.size(); ++sigma) {
        SigmaColumn column(problem, sigma, folds, options, targets);
        auto candidates = column.look_at_first_fold(no_bound, false, cancelled);
        if (!candidates) return std::unexpected(candidates.error());
        std::ranges::sort(*candidates, {}, &SigmaCandidate::C_index);
        for (const SigmaCandidate& candidate : *candidates) {
            const auto raced = column.race(candidate, everything, cancelled);
            if (!raced) return std::unexpected(raced.error());
            all.push_back((*raced)->mean_mse);
        }
    }
    return all;
}

Result<SvrModel> fit_model_low_rank(const LagProblem& problem, double C, double sigma,
                                    const SweepOptions& options) {
    const KernelFeatures kernel = kernel_features(problem, sigma, exact_tolerance(problem, C, sigma));
    const VectorXd targets = all_targets(problem);
    NewtonSystem system(kernel.by_row);
    TubeSolver solver(system, all_rows(targets), targets, options.epsilon);
    const TubeSolver::State start = near_the_optimum(kernel, targets, C, sigma, options.epsilon);
    if (!solver.fit(C, start, exact)) {
        return fail(NextStep::stop,
                    fmt::format("the fit at n = {}, C = {}, sigma = {} did not come to an end", problem.lags,
                                C, sigma));
    }
    const auto support = static_cast<std::size_t>((solver.coefficients().array() != 0.0).count());
    return SvrModel(problem, kernel.pivots, pivot_coefficients(kernel, solver.state().weights),
                    solver.state().bias, sigma, support);
}

}  // namespace thermbal
