#include "declaration/criterion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/median.hpp"

namespace thermbal {
namespace {

double upper_decile(std::vector<double> values) {
    const auto rank =
        values.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(values.size() - 1));
    std::ranges::nth_element(values, rank);
    return *rank;
}

double roughness(const std::vector<double>& y) {
    std::vector<double> bends;
    for (std::size_t i = 1; i + 1 < y.size(); ++i)
        bends.push_back(std::abs(y[i - 1] - 2.0 * y[i] + y[i + 1]));
    constexpr double sd_of_mad = 1.4826;
    return bends.empty() ? 0.0 : sd_of_mad * median(bends) / std::sqrt(6.0);
}

double allowed_gain_C(const RmseMinimum& found, const CriterionOptions& options) {
    return std::max(options.edge_gain_C, options.edge_gain_in_noises * found.noise_C);
}

bool has_ended(const RmseMinimum& found, const CriterionOptions& options) {
    return found.falling <= options.edge_fall || found.gain_C <= allowed_gain_C(found, options);
}

std::string end_of_curve(const RmseMinimum& found, std::size_t lags, const CriterionOptions& options) {
    if (found.falling <= options.edge_fall) return "the curve has turned or levelled off";
    const bool ended = has_ended(found, options);
    return fmt::format("{} at n = {} (by {:.3f} C, {:.2f} in ln; allowed {:.3f} C or {:.2f})",
                       ended ? "hardly falling any more" : "still falling", lags, found.gain_C, found.falling,
                       allowed_gain_C(found, options), options.edge_fall);
}

}  // namespace

RmseMinimum find_minimum(std::span<const double> rmse_by_n_C, double noise_C,
                         const CriterionOptions& options) {
    RmseMinimum found;
    found.noise_C = noise_C;
    found.guard.name = "clear_minimum";
    std::vector<double> y;  // of the usable n, in their order
    std::vector<int> lags;
    for (std::size_t i = 0; i < rmse_by_n_C.size(); ++i) {
        if (!std::isfinite(rmse_by_n_C[i]) || rmse_by_n_C[i] <= 0.0) continue;
        y.push_back(std::log(rmse_by_n_C[i]));
        lags.push_back(static_cast<int>(i) + 1);
    }
    if (static_cast<int>(y.size()) < options.min_lags) {
        found.guard.figures = fmt::format(
            "{} of {} numbers of lags give a free run that stays bounded, {} are needed for a curve",
            y.size(), rmse_by_n_C.size(), options.min_lags);
        return found;
    }
    const auto lowest = static_cast<std::size_t>(std::ranges::min_element(y) - y.begin());
    found.n = lags[lowest];
    found.rmse_C = std::exp(y[lowest]);
    found.depth = upper_decile(y) - y[lowest];
    found.scatter = roughness(y);
    const int before_the_edge = static_cast<int>(rmse_by_n_C.size()) - options.edge_lags;
    double lowest_before = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < y.size() && lags[i] <= before_the_edge; ++i)
        lowest_before = std::min(lowest_before, y[i]);
    found.falling = lowest_before - y[lowest];
    found.gain_C = std::exp(lowest_before) - found.rmse_C;
    found.clear = has_ended(found, options) && found.depth >= options.min_depth &&
                  found.depth >= options.min_depth_in_scatters * found.scatter;
    found.guard.passed = found.clear;
    found.guard.figures = fmt::format(
        "RMSE {:.3f} C at n = {}, {:.2f} below the curve in ln (needed {:.2f} and {:.1f} x its scatter "
        "{:.2f}), {}",
        found.rmse_C, found.n, found.depth, options.min_depth, options.min_depth_in_scatters, found.scatter,
        end_of_curve(found, rmse_by_n_C.size(), options));
    return found;
}

}  // namespace thermbal
