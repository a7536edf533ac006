#include "modes/spectrum.hpp"

#include <algorithm>
#include <cmath>

#include "base/units.hpp"
#include "channel_draws.hpp"
#include "spectrum_problem.hpp"

namespace thermbal {

namespace {

constexpr double carried_share = 0.05;
constexpr double sds_of_90_percent = 1.645;

/// The slowest time constant from which on `carried_share` of the amplitudes lie.
double slowest_carrying(const std::vector<double>& grid, const Eigen::VectorXd& amplitude) {
    const double total = amplitude.cwiseAbs().sum();
    double carried = 0.0;
    for (Eigen::Index j = amplitude.size() - 1; j >= 0; --j) {
        carried += std::abs(amplitude[j]);
        if (carried >= carried_share * total) return grid[static_cast<std::size_t>(j)];
    }
    return grid.front();
}

double range_over_the_last_hour_C(const AmbientInput& room, double period_s) {
    if (!room.measured || room.deviation_C.empty()) return 0.0;
    const auto hour = static_cast<std::size_t>(3600.0 / period_s);
    const std::size_t scans = std::min(hour, room.deviation_C.size());
    AmbientInput last = room;
    last.deviation_C.assign(room.deviation_C.end() - static_cast<std::ptrdiff_t>(scans),
                            room.deviation_C.end());
    return last.range_C();
}

/// Posterior mean coefficients as predict_curve wants them, but for the channel's centre.
Eigen::VectorXd coefficients_of(const BackgroundAmplitudes& background, const Eigen::VectorXd& of_modes) {
    Eigen::VectorXd coefficients(background.of_basis.size() + of_modes.size());
    coefficients << background.of_basis, of_modes;
    if (background.of_modes.size() > 0) coefficients.tail(of_modes.size()) += background.of_modes;
    return coefficients;
}

/// Of a steady state, what the room adds: by how far it has moved in all, and by what of that the channel has
/// yet to follow. Both are 0 without an ambient.
void split_off_the_room(const SpectrumProblem& problem, const Eigen::VectorXd& of_basis,
                        const Eigen::RowVectorXd& now, ChannelEstimate& channel) {
    if (!problem.basis.has_ambient) return;
    const Eigen::Index lags = problem.basis.grid();
    const Eigen::VectorXd answer = of_basis.tail(lags);
    const double gain = answer.sum();
    const double moved_C = problem.room.tail_C - problem.room.reference_C;
    channel.room_rise_C = gain * (problem.room_before_C + moved_C);
    channel.room_to_come_C = gain * moved_C - now.tail(lags).dot(answer);
}

/// How a posterior becomes an interval, see SpectrumOptions.
struct IntervalRule {
    double factor = 1.0;
    double floor_C = 0.0;
    double room_to_come_floor = 0.0;
};

IntervalRule interval_rule(const SpectrumProblem& problem, bool first_test_from_its_start,
                           const SpectrumOptions& options) {
    return {
        first_test_from_its_start ? options.interval_factor : 1.0,
        std::hypot(options.model_floor_C,
                   options.room_floor * range_over_the_last_hour_C(problem.room, problem.window.period_s)),
        options.room_to_come_floor};
}

/// Evenly about the channel's steady state.
void give_interval(const ChannelDraws& draws, const IntervalRule& rule, ChannelEstimate& channel) {
    const double sd_C = draws.standard_deviation();
    const double floor_C = std::hypot(rule.floor_C, rule.room_to_come_floor * channel.room_to_come_C);
    // A skewed posterior can have a narrow 90 % and a long tail: the wider of the two counts.
    const double half_C = std::hypot(
        rule.factor * std::max(draws.half_width_of_90_percent(), sds_of_90_percent * sd_C), floor_C);
    channel.steady_state_sd_C = std::hypot(rule.factor * sd_C, floor_C / sds_of_90_percent);
    channel.steady_state_low_C = channel.steady_state_C - half_C;
    channel.steady_state_high_C = channel.steady_state_C + half_C;
}

ChannelEstimate channel_estimate(const SpectrumProblem& problem, const ObservedChannel& observed,
                                 const ChannelDraws& draws, const CurveGrid& curves,
                                 const IntervalRule& rule) {
    const ReducedChannel& data = observed.data;
    ChannelEstimate channel;
    channel.channel = observed.name;
    channel.good_samples = data.good_samples;
    channel.used_responses = observed.responses.cols() > 0;
    channel.noise_C = std::sqrt(data.sample_variance);
    channel.resolution_C = data.resolution_C;
    channel.residual_rms_C = data.residual_rms_C;
    channel.variance_inflation = data.variance_inflation;

    const double settled = draws.steady_state();
    channel.steady_state_C = data.centre_C + settled;
    const BackgroundAmplitudes background = spread_responses(observed, problem.basis, draws.background);
    const Eigen::VectorXd curve = background_curve(background, curves) + curves.fine * draws.fine;
    Eigen::VectorXd coefficients = coefficients_of(background, draws.fine);
    coefficients[0] += data.centre_C;
    channel.coefficients.assign(coefficients.begin(), coefficients.end());
    channel.start_C = coefficients[0];
    channel.last_C = data.centre_C + curve[problem.design.rows()];
    const double start_C = std::isnan(observed.test_start_C) ? channel.start_C : observed.test_start_C;
    channel.rise_C = channel.steady_state_C - start_C;
    split_off_the_room(problem, coefficients.head(problem.basis.size()),
                       curves.design.row(problem.design.rows()), channel);
    give_interval(draws, rule, channel);
    channel.equilibrium_time_min = problem.window.start_s / seconds_per_min +
                                   crossing_time(curves.minute, curve, start_C - data.centre_C, settled);
    channel.equilibrium_low_min =
        std::min(sorted_quantile(draws.equilibrium_min, 0.05), channel.equilibrium_time_min);
    channel.equilibrium_high_min =
        std::max(sorted_quantile(draws.equilibrium_min, 0.95), channel.equilibrium_time_min);
    channel.slowest_time_constant_min =
        slowest_carrying(problem.fine_grid, coefficients.tail(draws.fine.size()));
    return channel;
}

}  // namespace

bool SpectrumEstimate::used_responses() const {
    return std::ranges::any_of(channels, &ChannelEstimate::used_responses);
}

Result<SpectrumEstimate> estimate_spectrum(const TestWindow& recorded, std::string_view ambient,
                                           const std::optional<SpectrumPrior>& prior,
                                           const SpectrumOptions& options, std::uint64_t seed,
                                           const std::vector<double>& start_level_C) {
    Result<SpectrumProblem> posed = pose_problem(recorded, ambient, prior, options, start_level_C);
    if (!posed) return std::unexpected(posed.error());
    SpectrumProblem& problem = *posed;
    std::vector<ChannelModel> models = channel_models(problem, options);
    if (problem.room.measured && problem.room.range_C() > options.ambient_matters_C) {
        tie_room_to_modes(mode_states(problem, models, options, options.draws / 4, seed), options, problem);
        models = channel_models(problem, options);
    }
    const CurveGrid curves = curve_grid(problem);
    const SpectrumDraws draws = draw_channels(
        problem, models, mode_states(problem, models, options, options.draws, seed), curves, seed);

    SpectrumEstimate estimate;
    estimate.time_constant_min = problem.fine_grid;
    estimate.background_time_constant_min = problem.basis.time_constant_min;
    estimate.mode_density.assign(draws.density.begin(), draws.density.end());
    estimate.mode_log_variance.assign(draws.log_variance.begin(), draws.log_variance.end());
    estimate.expected_modes = draws.density.sum();
    estimate.mode_energy = sorted_quantile(draws.mode_energy, 0.5);
    estimate.window_start_s = problem.window.start_s;
    estimate.window_end_s = problem.window.end_s();
    estimate.ambient_reference_C = problem.room.reference_C;
    estimate.ambient_tail_C = problem.room.tail_C;
    estimate.has_ambient = problem.room.measured;
    estimate.blocks = static_cast<std::size_t>(problem.design.rows());
    const IntervalRule rule = interval_rule(problem, !prior && start_level_C.empty(), options);
    Eigen::VectorXd amplitudes = Eigen::VectorXd::Zero(draws.density.size());
    for (std::size_t k = 0; k < problem.channels.size(); ++k) {
        estimate.channels.push_back(
            channel_estimate(problem, problem.channels[k], draws.channels[k], curves, rule));
        const std::vector<double>& own = estimate.channels.back().coefficients;
        amplitudes += Eigen::Map<const Eigen::VectorXd>(own.data(), static_cast<Eigen::Index>(own.size()))
                          .tail(amplitudes.size())
                          .cwiseAbs();
    }
    estimate.slowest_time_constant_min = slowest_carrying(problem.fine_grid, amplitudes);
    return estimate;
}

std::vector<double> predict_curve(const SpectrumEstimate& estimate, const ChannelEstimate& channel,
                                  const TestWindow& window, std::string_view ambient,
                                  const std::vector<double>& time_s) {
    const TestWindow fitted =
        window_from(window_until(window, estimate.window_end_s), estimate.window_start_s);
    const AmbientInput room =
        ambient_input(fitted, estimate.has_ambient ? ambient : std::string_view{}, 15.0);
    const Basis basis{estimate.background_time_constant_min, estimate.has_ambient};
    const Eigen::MatrixXd inside = block_design(basis, fitted, room, 1);
    const Eigen::VectorXd coefficients = Eigen::Map<const Eigen::VectorXd>(
        channel.coefficients.data(), static_cast<Eigen::Index>(channel.coefficients.size()));
    const Eigen::VectorXd of_basis = coefficients.head(basis.size());
    const Eigen::VectorXd of_modes = coefficients.tail(coefficients.size() - basis.size());
    std::vector<double> minute;
    minute.reserve(time_s.size());
    for (const double time : time_s) minute.push_back((time - fitted.start_s) / seconds_per_min);
    const Eigen::VectorXd modes = step_columns(estimate.time_constant_min, minute) * of_modes;
    const Eigen::VectorXd past = inside * of_basis;
    std::vector<double> after;
    after.reserve(time_s.size());
    for (const double time : time_s)
        after.push_back(std::max(0.0, (time - fitted.end_s()) / seconds_per_min));
    const Eigen::VectorXd future = future_design(basis, fitted, room, after) * of_basis;
    std::vector<double> curve;
    for (std::size_t k = 0; k < time_s.size(); ++k) {
        const double position = (time_s[k] - fitted.start_s) / fitted.period_s;
        if (position >= static_cast<double>(fitted.scans - 1)) {
            curve.push_back(modes[static_cast<Eigen::Index>(k)] + future[static_cast<Eigen::Index>(k)]);
            continue;
        }
        const auto scan = static_cast<Eigen::Index>(std::max(0.0, std::floor(position)));
        const double share = std::clamp(position - static_cast<double>(scan), 0.0, 1.0);
        curve.push_back(modes[static_cast<Eigen::Index>(k)] + (1.0 - share) * past[scan] +
                        share * past[scan + 1]);
    }
    return curve;
}

}  // namespace thermbal
