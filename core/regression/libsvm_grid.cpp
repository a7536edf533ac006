#include "libsvm_grid.hpp"

#include <numeric>

#include "regression/kernel.hpp"
#include "regression/libsvm_solver.hpp"

namespace thermbal {
namespace {

SvrParameters parameters_at(double C, double sigma, const SweepOptions& options) {
    return {.C = C, .sigma = sigma, .epsilon = options.epsilon, .tolerance = options.solver_tolerance};
}

double held_out_mse(const Eigen::MatrixXd& kernel, const Fold& fold, const SvrFit& fit,
                    std::span<const double> targets) {
    double sum = 0.0;
    for (const std::size_t row : fold.held_out_rows) {
        double predicted = fit.bias;
        for (std::size_t k = 0; k < fold.training_rows.size(); ++k) {
            if (fit.coefficient[k] == 0.0) continue;
            predicted += fit.coefficient[k] * kernel(static_cast<Eigen::Index>(fold.training_rows[k]),
                                                     static_cast<Eigen::Index>(row));
        }
        sum += (predicted - targets[row]) * (predicted - targets[row]);
    }
    return sum / static_cast<double>(fold.held_out_rows.size());
}

}  // namespace

Result<std::vector<double>> cross_validate_by_libsvm(const LagProblem& problem, const SweepOptions& options,
                                                     const Cancelled& cancelled) {
    const auto folds = make_folds(problem.rows(), options.folds, options.fold_kind, options.fold_seed);
    const auto distances = squared_distances(problem);
    std::vector<double> mean_mse;
    for (const double sigma : options.sigma_grid) {
        const auto kernel = gaussian_kernel(distances, sigma);
        const LibsvmSolver solver(kernel);
        for (const double C : options.C_grid) {
            double sum = 0.0;
            for (const Fold& fold : folds) {
                if (cancelled()) return sweep_cancelled();
                const auto fit =
                    solver.fit(fold.training_rows, problem.targets(), parameters_at(C, sigma, options));
                if (!fit) return std::unexpected(fit.error());
                sum += held_out_mse(kernel, fold, *fit, problem.targets());
            }
            mean_mse.push_back(sum / static_cast<double>(folds.size()));
        }
    }
    return mean_mse;
}

Result<SvrModel> fit_model_by_libsvm(const LagProblem& problem, double C, double sigma,
                                     const SweepOptions& options) {
    std::vector<std::size_t> rows(problem.rows());
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    const LibsvmSolver solver(gaussian_kernel(squared_distances(problem), sigma));
    const auto fit = solver.fit(rows, problem.targets(), parameters_at(C, sigma, options));
    if (!fit) return std::unexpected(fit.error());
    return SvrModel(problem, *fit, sigma);
}

}  // namespace thermbal
