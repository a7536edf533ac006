#include "regression/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "regression/grid_search.hpp"

namespace thermbal {
namespace {

/// False for NaN.
bool within(double value, double lowest, double highest) {
    return value >= lowest && value <= highest;
}

Result<void> check_grid(const char* name, const std::vector<double>& grid) {
    if (grid.empty() || grid.size() > 64) {
        return fail(NextStep::refuse_input,
                    fmt::format("{} has {} values: must be 1 to 64", name, grid.size()));
    }
    for (std::size_t k = 0; k < grid.size(); ++k) {
        const bool ascends = k == 0 || grid[k] > grid[k - 1];
        if (!within(grid[k], 1e-9, 1e9) || !ascends) {
            return fail(NextStep::refuse_input,
                        fmt::format("{}[{}] = {}: must ascend, 1e-9 to 1e9", name, k, grid[k]));
        }
    }
    return {};
}

Result<void> check_window(std::span<const double> filtered_C, const SweepOptions& options) {
    if (filtered_C.size() >= fewest_samples(options)) return {};
    return fail(NextStep::refuse_input,
                fmt::format("{} samples in the window: {} folds at n = {} take at least {}",
                            filtered_C.size(), options.folds, options.last_lag, fewest_samples(options)));
}

/// Free run from the first n samples over the rest of the window.
FreeRun run_over_window(const LagProblem& problem, const SvrModel& model, const FreeRunOptions& options) {
    return run_freely(model, problem.scale, problem.input(0), problem.rows(), options);
}

std::span<const double> newest(const LagProblem& problem) {
    return std::span(problem.unit).last(problem.lags);
}

void judge_over_window(LagFit& fit, const FreeRun& run, std::span<const double> filtered_C) {
    fit.leaves_range = run.leaves_range;
    fit.window_rmse_C = run.leaves_range
                            ? std::numeric_limits<double>::infinity()
                            : root_mean_square_error_C(run.temperature_C, filtered_C.subspan(fit.n));
}

void judge_ahead(LagFit& fit, const FreeRun& ahead) {
    fit.leaves_range = fit.leaves_range || ahead.leaves_range;
    fit.settles = ahead.settles;
    fit.steady_state_C = ahead.steady_state_C;
    fit.settled_after = ahead.settled_after;
}

Result<LagFit> identify_at(std::span<const double> filtered_C, std::size_t n, const SweepOptions& options,
                           const Cancelled& cancelled) {
    const auto problem = make_lag_problem(filtered_C, n, options.smallest_range_C);
    if (!problem) return std::unexpected(problem.error());
    const auto choice = search_grid(*problem, options, cancelled);
    if (!choice) return std::unexpected(choice.error());
    const auto model = fit_model(*problem, choice->C, choice->sigma, options);
    if (!model) return std::unexpected(model.error());
    LagFit fit;
    fit.n = n;
    fit.C = choice->C;
    fit.sigma = choice->sigma;
    fit.cv_rmse_C = problem->scale.range_C * std::sqrt(choice->cv_mse_unit);
    fit.support_vectors = model->support_vectors();
    judge_over_window(fit, run_over_window(*problem, *model, options.free_run), filtered_C);
    judge_ahead(fit, run_until_settled(*model, problem->scale, newest(*problem), options.free_run));
    return fit;
}

}  // namespace

Result<void> SweepOptions::check() const {
    if (first_lag < 1 || last_lag < first_lag || last_lag > 200) {
        return fail(NextStep::refuse_input,
                    fmt::format("first_lag = {}, last_lag = {}: must be 1 <= first <= last <= 200", first_lag,
                                last_lag));
    }
    if (folds < 2 || folds > 20) {
        return fail(NextStep::refuse_input, fmt::format("folds = {}: must be 2 to 20", folds));
    }
    if (!within(epsilon, 1e-9, 0.5)) {
        return fail(NextStep::refuse_input, fmt::format("epsilon = {}: must be 1e-9 to 0.5", epsilon));
    }
    if (!within(solver_tolerance, 1e-8, 0.1)) {
        return fail(NextStep::refuse_input,
                    fmt::format("solver_tolerance = {}: must be 1e-8 to 0.1", solver_tolerance));
    }
    if (!(smallest_range_C >= 0.0)) {
        return fail(NextStep::refuse_input,
                    fmt::format("smallest_range_C = {}: must not be negative", smallest_range_C));
    }
    if (auto C_checked = check_grid("C_grid", C_grid); !C_checked) return C_checked;
    if (auto sigma_checked = check_grid("sigma_grid", sigma_grid); !sigma_checked) return sigma_checked;
    return free_run.check();
}

std::size_t fewest_samples(const SweepOptions& options) {
    return options.last_lag + 2 * options.folds;
}

Result<SweepResult> sweep(std::span<const double> filtered_C, const SweepOptions& options,
                          const ParallelFor& parallel_for, const Cancelled& cancelled) {
    if (auto checked = options.check(); !checked) return std::unexpected(checked.error());
    if (auto checked = check_window(filtered_C, options); !checked) return std::unexpected(checked.error());
    const std::size_t lags = options.last_lag - options.first_lag + 1;
    std::vector<Result<LagFit>> fits(lags);
    // The largest n takes longest: it goes first.
    parallel_for(lags, [&](std::size_t job) {
        const std::size_t k = lags - 1 - job;
        fits[k] = identify_at(filtered_C, options.first_lag + k, options, cancelled);
    });
    SweepResult result;
    for (const auto& fit : fits) {
        if (!fit) return std::unexpected(fit.error());
        result.by_lag.push_back(*fit);
    }
    return result;
}

Result<Prediction> predict(std::span<const double> filtered_C, std::size_t n, double C, double sigma,
                           std::size_t horizon, const SweepOptions& options) {
    SweepOptions at_point = options;
    at_point.first_lag = at_point.last_lag = n;
    at_point.C_grid = {C};
    at_point.sigma_grid = {sigma};
    if (auto checked = at_point.check(); !checked) return std::unexpected(checked.error());
    if (auto checked = check_window(filtered_C, at_point); !checked) return std::unexpected(checked.error());
    const auto problem = make_lag_problem(filtered_C, n, options.smallest_range_C);
    if (!problem) return std::unexpected(problem.error());
    const auto model = fit_model(*problem, C, sigma, options);
    if (!model) return std::unexpected(model.error());

    Prediction prediction;
    prediction.fit = {.n = n, .C = C, .sigma = sigma, .cv_rmse_C = std::numeric_limits<double>::quiet_NaN()};
    prediction.fit.support_vectors = model->support_vectors();
    const FreeRun over_window = run_over_window(*problem, *model, options.free_run);
    judge_over_window(prediction.fit, over_window, filtered_C);
    judge_ahead(prediction.fit,
                run_until_settled(*model, problem->scale, newest(*problem), options.free_run));
    prediction.window_C.assign(filtered_C.begin(), filtered_C.begin() + static_cast<std::ptrdiff_t>(n));
    prediction.window_C.insert(prediction.window_C.end(), over_window.temperature_C.begin(),
                               over_window.temperature_C.end());
    prediction.predicted_C =
        run_freely(*model, problem->scale, newest(*problem), horizon, options.free_run).temperature_C;
    return prediction;
}

}  // namespace thermbal
