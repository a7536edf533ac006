#include "linear_floor.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "regression/panels.hpp"

namespace thermbal {
namespace {

/// Keeps the factorisation positive definite where the lags of a smooth window depend on one another.
constexpr double relative_ridge = 1e-12;

/// The last element of the factor of (X 1 y)'(X 1 y) is the norm of what is left of y.
double floor_on(const LagProblem& problem, const std::vector<std::size_t>& rows) {
    const std::size_t unknowns = problem.lags + 1;
    PanelMatrix columns;
    columns.set_zero(unknowns + 1, rows.size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
        const auto input = problem.input(rows[k]);
        for (std::size_t lag = 0; lag < problem.lags; ++lag) columns.at(lag, k) = input[lag];
        columns.at(problem.lags, k) = 1.0;
        columns.at(unknowns, k) = problem.targets()[rows[k]];
    }
    PanelMatrix gram;
    gram.set_zero_lower(columns.padded_rows());
    add_products(columns, 1.0, gram);
    const auto count = static_cast<double>(rows.size());
    for (std::size_t i = 0; i < gram.padded_rows(); ++i) {
        gram.at(i, i) += i < unknowns ? relative_ridge * count : i > unknowns ? 1.0 : 0.0;
    }
    PanelCholesky().factor(gram);
    const double left_over = gram.at(unknowns, unknowns);
    return left_over > 0.0 ? left_over / std::sqrt(count) : 0.0;
}

}  // namespace

std::vector<double> linear_floor(const LagProblem& problem, const std::vector<Fold>& folds) {
    std::vector<double> floor;
    floor.reserve(folds.size());
    for (const Fold& fold : folds) floor.push_back(floor_on(problem, fold.held_out_rows));
    return floor;
}

double linear_rmse(const LagProblem& problem) {
    std::vector<std::size_t> rows(problem.rows());
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    return floor_on(problem, rows);
}

}  // namespace thermbal
