#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "design.hpp"
#include "generic_prior.hpp"
#include "modes/spectrum.hpp"

namespace thermbal {

GenericPrior generic_prior(const SpectrumOptions& options) {
    GenericPrior prior;
    prior.time_constant_min = logarithmic_grid(options.fastest_min, options.slowest_min, options.grid);
    double sum = 0.0;
    for (const double tau : prior.time_constant_min) {
        prior.intensity.push_back(
            tau > options.falloff_min ? std::pow(options.falloff_min / tau, options.falloff_power) : 1.0);
        sum += prior.intensity.back();
    }
    for (double& value : prior.intensity) value *= options.expected_modes / sum;
    prior.log_variance_mean.assign(options.grid, options.mode_log_variance_mean);
    prior.log_variance_sd.assign(options.grid, options.mode_log_variance_sd);
    return prior;
}

Result<void> SpectrumOptions::check() const {
    const auto refuse = [](std::string_view field, double found, std::string_view accepted) {
        return fail(NextStep::refuse_input, fmt::format("{} is {}, accepted is {}", field, found, accepted));
    };
    if (grid < 8 || grid > 1000) return refuse("grid", static_cast<double>(grid), "8 to 1000");
    if (background_points < 4 || background_points > 200) {
        return refuse("background_points", static_cast<double>(background_points), "4 to 200");
    }
    if (!(fastest_min > 0.0)) return refuse("fastest_min", fastest_min, "above 0");
    if (!(slowest_min > fastest_min)) return refuse("slowest_min", slowest_min, "above fastest_min");
    if (!(block_min > 0.0)) return refuse("block_min", block_min, "above 0");
    if (!(expected_modes > 0.0)) return refuse("expected_modes", expected_modes, "above 0");
    if (!(falloff_min > 0.0)) return refuse("falloff_min", falloff_min, "above 0");
    if (!(mode_log_variance_sd > 0.0)) return refuse("mode_log_variance_sd", mode_log_variance_sd, "above 0");
    if (!(background_level > 0.0)) return refuse("background_level", background_level, "above 0");
    if (!(ambient_gain_sd > 0.0)) return refuse("ambient_gain_sd", ambient_gain_sd, "above 0");
    if (draws < 20) return refuse("draws", static_cast<double>(draws), "20 or more");
    if (thinning < 1) return refuse("thinning", static_cast<double>(thinning), "1 or more");
    return {};
}

}  // namespace thermbal
