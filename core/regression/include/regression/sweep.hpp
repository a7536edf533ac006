#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "regression/folds.hpp"
#include "regression/free_run.hpp"

namespace thermbal {

enum class SvrSolver {
    low_rank,  ///< ours: Newton's method on low-rank kernels; the exact optimum, hundreds of times faster
    libsvm,    ///< the reference
};

/// Every choice of the identification. What the paper (Feng, Xia, Sun, Fu 2015) fixes: epsilon = 0.001, n = 1
/// ... 35, Gaussian kernel, grid search with cross-validation over C and sigma, eq. (7). The rest is ours;
/// README.md of this room says why.
struct SweepOptions {
    std::size_t first_lag = 1;
    std::size_t last_lag = 35;
    std::vector<double> C_grid{0.0625, 0.25, 1.0, 4.0, 16.0, 64.0, 256.0, 1024.0};
    std::vector<double> sigma_grid{0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0};
    double epsilon = 0.001;
    std::size_t folds = 5;
    FoldKind fold_kind = FoldKind::contiguous;
    std::uint64_t fold_seed = 1;     ///< of shuffled folds
    double smallest_range_C = 1e-6;  ///< a window with less is refused as flat
    SvrSolver solver = SvrSolver::low_rank;
    double solver_tolerance = 1e-3;  ///< of libsvm alone: its and scikit-learn's default
    FreeRunOptions free_run;

    /// Errors (refuse_input) name the field, its value and the bound.
    Result<void> check() const;
};

/// The best grid point at one number of lags, and what its model says.
struct LagFit {
    std::size_t n = 0;
    double C = 0.0;
    double sigma = 0.0;
    double cv_rmse_C = 0.0;  ///< root of the mean over folds of the held-out mean squared error of one step
    double window_rmse_C = 0.0;   ///< eq. (7): free run from the first n samples against the filtered window;
                                  ///< infinite if it leaves the range
    double steady_state_C = 0.0;  ///< of the free run from the newest n samples; NaN unless it settles
    bool settles = false;
    bool leaves_range = false;      ///< one of the two runs went beyond the free_run options' physical range
    std::size_t settled_after = 0;  ///< samples after the window's end
    std::size_t support_vectors = 0;
};

struct SweepResult {
    std::vector<LagFit> by_lag;  ///< first_lag ... last_lag
};

inline std::unexpected<Error> sweep_cancelled() {
    return fail(NextStep::stop, "the sweep was cancelled");
}

/// Fewest samples a sweep with these options takes: two rows a fold at the largest n.
std::size_t fewest_samples(const SweepOptions& options);

/// For each n: grid search by cross-validation, refit on the whole window, free run over it, free run on
/// until it settles. `filtered_C`: uniform grid, no gaps. The result does not depend on parallel_for's order
/// or number of threads. Errors: refuse_input for options out of bounds, a NaN, a flat window or one with
/// fewer than fewest_samples(); stop when cancelled.
Result<SweepResult> sweep(std::span<const double> filtered_C, const SweepOptions& options,
                          const ParallelFor& parallel_for, const Cancelled& cancelled = never_cancelled);

/// The model of one grid point on the whole window, run freely.
struct Prediction {
    std::vector<double>
        window_C;  ///< as long as the window: its first n samples, then the free run from them
    std::vector<double>
        predicted_C;  ///< `horizon` samples after the window's newest (fewer if it leaves the range)
    LagFit fit;       ///< cv_rmse_C is NaN here
};

/// Errors as sweep(). `horizon` in samples.
Result<Prediction> predict(std::span<const double> filtered_C, std::size_t n, double C, double sigma,
                           std::size_t horizon, const SweepOptions& options);

}  // namespace thermbal
