#include "race_bounds.hpp"

#include <algorithm>
#include <cmath>

namespace thermbal {

/// Measured on 20 000 fits of warm-ups, noise, gaps and cycles (README.md): one in 200 falls lower, by a few
/// hundredths.
double lowest_rmse(double rmse, double before, double smoothing) {
    const double without_change = rmse - 2.0 * std::abs(rmse - before) - smoothing;
    return std::max(rmse / 4.0, without_change / (1.0 + 0.45 * std::sqrt(smoothing / rmse)));
}

double lowest_rmse_at_first(double rmse, double smoothing) {
    constexpr double unseen_change = 2.5;
    return lowest_rmse(rmse, rmse + unseen_change * smoothing, smoothing);
}

namespace {

constexpr std::size_t many_rows = 800;

/// The first fold's error that alone makes the mean worse than the best.
double losing_rmse(double best_mean_mse, std::size_t folds) {
    return std::sqrt(best_mean_mse * static_cast<double>(folds));
}

}  // namespace

double worse_rmse(double best_mean_mse, std::size_t folds) {
    return 1.5 * losing_rmse(best_mean_mse, folds);
}

double hopeless_rmse(double best_mean_mse, std::size_t folds) {
    return 5.0 * losing_rmse(best_mean_mse, folds);
}

double truncation_share(std::size_t rows, double noise_in_epsilons) {
    if (rows < many_rows) return 0.1;
    const double strength = noise_in_epsilons / 8.0;
    return std::clamp(strength * strength, 1.0, 32.0);
}

double truncation(double share, double rmse, double coefficient_sum, double finest) {
    const double enough = share * rmse / coefficient_sum;
    if (!(enough > finest)) return finest;
    return std::clamp(std::exp2(2.0 * std::floor(0.5 * std::log2(enough))), finest, 1e-2);
}

std::size_t features_worth_having(std::size_t rows, double smoothing, double noise_rmse) {
    // Normally distributed residuals: 0.8 of the rows bend times the smoothing over their standard deviation.
    // Fewer features than half of few rows, or a quarter of many, are not slower (README.md).
    const double never_too_many = rows < many_rows ? 0.5 : 0.25;
    const double share = std::clamp(1.2 * smoothing / noise_rmse, never_too_many, 1.0);
    return static_cast<std::size_t>(share * static_cast<double>(rows));
}

}  // namespace thermbal
