#include "regression/grid_search.hpp"

#include <algorithm>

#include "libsvm_grid.hpp"
#include "low_rank_grid.hpp"

namespace thermbal {

Result<std::vector<double>> cross_validate_grid(const LagProblem& problem, const SweepOptions& options,
                                                const Cancelled& cancelled) {
    return options.solver == SvrSolver::libsvm ? cross_validate_by_libsvm(problem, options, cancelled)
                                               : cross_validate_low_rank(problem, options, cancelled);
}

Result<GridChoice> search_grid(const LagProblem& problem, const SweepOptions& options,
                               const Cancelled& cancelled) {
    if (options.solver == SvrSolver::low_rank) return search_grid_low_rank(problem, options, cancelled);
    const auto mean_mse = cross_validate_by_libsvm(problem, options, cancelled);
    if (!mean_mse) return std::unexpected(mean_mse.error());
    const auto best = static_cast<std::size_t>(std::ranges::min_element(*mean_mse) - mean_mse->begin());
    return GridChoice{options.C_grid[best % options.C_grid.size()],
                      options.sigma_grid[best / options.C_grid.size()], (*mean_mse)[best]};
}

Result<SvrModel> fit_model(const LagProblem& problem, double C, double sigma, const SweepOptions& options) {
    return options.solver == SvrSolver::libsvm ? fit_model_by_libsvm(problem, C, sigma, options)
                                               : fit_model_low_rank(problem, C, sigma, options);
}

}  // namespace thermbal
