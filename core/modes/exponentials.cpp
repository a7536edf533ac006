#include "modes/exponentials.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "modes/information_limit.hpp"

namespace thermbal {

namespace {

double value_at(const SharedModes& fit, double minute) {
    const SharedModes::Channel& channel = fit.channels.front();
    double value_C = channel.level_C;
    for (std::size_t k = 0; k < fit.time_constant_min.size(); ++k)
        value_C -= channel.amplitude_C[k] * std::expm1(-minute / fit.time_constant_min[k]);
    return value_C;
}

/// When the curve is first 95 % of its way; a curve of several exponentials need not be monotonic.
double equilibrium_min(const SharedModes& fit, double start_C, double steady_state_C) {
    constexpr double step_min = 0.25;
    constexpr double slow_time_constants = 10.0;
    const double latest_min = slow_time_constants * fit.time_constant_min.back();
    const double way_C = steady_state_C - start_C;
    for (double minute = 0.0; minute <= latest_min; minute += step_min) {
        if ((value_at(fit, minute) - start_C) / way_C >= 0.95) return minute;
    }
    return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

Result<ExponentialFit> fit_exponentials(const TestWindow& window, std::string_view channel,
                                        std::size_t exponentials) {
    const Column* const column = window.channel(channel);
    if (column == nullptr)
        return fail(NextStep::refuse_input, fmt::format("channel {} is not in the recording", channel));
    // Whole minutes, which the fit takes the means of: a last one of a single sample would weigh as much as
    // the others.
    const auto samples_a_min = static_cast<std::size_t>(std::max(1.0, std::round(60.0 / window.period_s)));
    TestWindow alone{
        window.start_s, window.period_s, window.scans / samples_a_min * samples_a_min, {*column}, {}};
    alone.channels.front().values.resize(alone.scans);
    Result<SharedModes> fit = fit_shared_modes(alone, "", exponentials);
    if (!fit) return std::unexpected(fit.error());

    SharedModes::Channel& only = fit->channels.front();
    // What a block's mean leaves over, as the scatter of one sample: the misfit of the order counts as noise.
    only.noise_C =
        std::max(only.noise_C, fit->residual_rms_C * std::sqrt(static_cast<double>(samples_a_min)));
    ExponentialFit result;
    result.start_C = only.level_C;
    result.steady_state_C = only.level_C;
    for (const double amplitude_C : only.amplitude_C) result.steady_state_C += amplitude_C;
    const double seen_min = (window.end_s() - window.start_s) / 60.0;
    const double bound_C =
        steady_state_bound_C(*fit, window.period_s, seen_min, SharedKnowledge::single_channel).front();
    if (std::isfinite(bound_C)) result.steady_state_sd_C = bound_C;
    result.equilibrium_time_min = equilibrium_min(*fit, result.start_C, result.steady_state_C);
    result.time_constant_min = std::move(fit->time_constant_min);
    return result;
}

}  // namespace thermbal
