#include "modes/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "design.hpp"
#include "gibbs.hpp"
#include "series/sample.hpp"

namespace thermbal {

namespace {

constexpr double seconds_per_min = 60.0;
constexpr double minimum_window_min = 8.0;
constexpr std::size_t curve_draws = 60;
constexpr double settled_share = 0.95;
constexpr double carried_share = 0.05;

std::size_t scans_per_block(const TestWindow& window, const SpectrumOptions& options) {
    return std::max<std::size_t>(
        1, static_cast<std::size_t>(std::lround(options.block_min * seconds_per_min / window.period_s)));
}

WeightPrior weight_prior(const Basis& basis, const std::optional<SpectrumPrior>& archive,
                         const SpectrumOptions& options) {
    const Eigen::Index grid = basis.grid();
    WeightPrior prior;
    prior.shape = Eigen::VectorXd::Constant(grid, options.weight_shape);
    prior.fixed_rate = Eigen::VectorXd::Zero(grid);
    prior.level_profile = Eigen::VectorXd::Zero(grid);
    prior.level_shape = options.base_shape;
    prior.level_rate = options.base_shape / options.base_level;
    prior.scale_shape = options.scale_shape;
    prior.scale_floor = options.scale_floor;
    prior.ambient_gain_sd = options.ambient_gain_sd;
    for (Eigen::Index j = 0; j < grid; ++j) {
        const auto index = static_cast<std::size_t>(j);
        const double tau = basis.time_constant_min[index];
        prior.level_profile[j] =
            options.weight_shape *
            (tau > options.falloff_min ? std::pow(options.falloff_min / tau, options.falloff_power) : 1.0);
        if (!archive) continue;
        // An inverse gamma whose logarithm has the archive's mean and (nearly) its spread.
        const double sd = std::max(0.3, archive->log_weight_sd[index]);
        prior.shape[j] = 1.0 / (sd * sd) + 0.5;
        prior.fixed_rate[j] = std::exp(archive->log_weight_mean[index]) * std::max(prior.shape[j] - 0.5, 0.1);
        prior.level_profile[j] = 0.0;
    }
    if (!basis.has_ambient) return prior;
    prior.ambient_mean.resize(grid);
    for (Eigen::Index j = 0; j < grid; ++j) {
        const double z =
            std::log(basis.time_constant_min[static_cast<std::size_t>(j)] / options.ambient_centre_min) /
            options.ambient_spread;
        prior.ambient_mean[j] = std::exp(-0.5 * z * z);
    }
    prior.ambient_mean /= prior.ambient_mean.sum();
    // As the shares of a Dirichlet distribution of low concentration vary.
    prior.ambient_variance = 0.5 * prior.ambient_mean;
    return prior;
}

Eigen::VectorXd steady_state_functional(const Basis& basis, const AmbientInput& ambient) {
    Eigen::VectorXd functional = Eigen::VectorXd::Ones(basis.size());
    if (basis.has_ambient) functional.tail(basis.grid()).setConstant(ambient.tail_C - ambient.reference_C);
    return functional;
}

/// Quantile of an equal mixture of normals, by bisection.
double mixture_quantile(const ChannelDraws& draws, double widening, double probability) {
    double low = draws.mean.front();
    double high = low;
    for (std::size_t k = 0; k < draws.mean.size(); ++k) {
        const double reach = 8.0 * widening * std::sqrt(draws.variance[k]) + 1e-9;
        low = std::min(low, draws.mean[k] - reach);
        high = std::max(high, draws.mean[k] + reach);
    }
    for (int step = 0; step < 60; ++step) {
        const double middle = 0.5 * (low + high);
        double below = 0.0;
        for (std::size_t k = 0; k < draws.mean.size(); ++k) {
            const double sd = widening * std::sqrt(draws.variance[k]) + 1e-12;
            below += 0.5 * std::erfc((draws.mean[k] - middle) / (sd * std::sqrt(2.0)));
        }
        (below / static_cast<double>(draws.mean.size()) < probability ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

/// Minutes of the prediction grid: inside the window coarsely, beyond it on a geometric grid.
struct CurveGrid {
    std::vector<double> minute;  ///< since the window's start
    Eigen::MatrixXd design;
};

CurveGrid curve_grid(const Basis& basis, const TestWindow& window, const AmbientInput& ambient,
                     const Eigen::MatrixXd& blocks, std::size_t per_block) {
    CurveGrid grid;
    const double period_min = window.period_s / seconds_per_min;
    for (Eigen::Index row = 0; row < blocks.rows(); ++row) {
        const auto first = static_cast<std::size_t>(row) * per_block;
        const std::size_t last = std::min(first + per_block, window.scans);
        grid.minute.push_back(0.5 * static_cast<double>(first + last - 1) * period_min);
    }
    std::vector<double> after{0.0};
    for (double step = 0.5; step < 6000.0; step *= 1.08) after.push_back(step);
    const double end_min = static_cast<double>(window.scans - 1) * period_min;
    for (const double value : after) grid.minute.push_back(end_min + value);
    const Eigen::MatrixXd future = future_design(basis, window, ambient, after);
    grid.design.resize(blocks.rows() + future.rows(), basis.size());
    grid.design << blocks, future;
    return grid;
}

/// First time at which the curve has done `settled_share` of its way from `start` to `settled`.
double crossing_time(const std::vector<double>& minute, const Eigen::VectorXd& curve, double start,
                     double settled) {
    const double target = start + settled_share * (settled - start);
    const double sign = settled >= start ? 1.0 : -1.0;
    double previous = 0.0;
    for (Eigen::Index k = 0; k < curve.size(); ++k) {
        const double excess = sign * (curve[k] - target);
        const auto index = static_cast<std::size_t>(k);
        if (excess >= 0.0) {
            if (k == 0) return minute[0];
            const double share = previous / (previous - excess);
            return minute[index - 1] + share * (minute[index] - minute[index - 1]);
        }
        previous = excess;
    }
    return minute.back();
}

double sorted_quantile(std::vector<double> values, double probability) {
    std::sort(values.begin(), values.end());
    const double position = probability * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(position);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return values[below] + (position - std::floor(position)) * (values[above] - values[below]);
}

double slowest_carrying(const std::vector<double>& grid, const Eigen::VectorXd& amplitude) {
    const double total = amplitude.cwiseAbs().sum();
    double carried = 0.0;
    for (Eigen::Index j = amplitude.size() - 1; j >= 0; --j) {
        carried += std::abs(amplitude[j]);
        if (carried >= carried_share * total) return grid[static_cast<std::size_t>(j)];
    }
    return grid.front();
}

Result<void> check_prior(const std::optional<SpectrumPrior>& prior, const std::vector<double>& grid) {
    if (!prior) return {};
    const bool fits = prior->time_constant_min.size() == grid.size() &&
                      prior->log_weight_mean.size() == grid.size() &&
                      prior->log_weight_sd.size() == grid.size() &&
                      std::abs(prior->time_constant_min.back() / grid.back() - 1.0) < 1e-6;
    if (fits) return {};
    return fail(
        NextStep::refuse_input,
        fmt::format(
            "the archive's spectrum has {} time constants, the options ask for {}: learn it again from "
            "the stored tests",
            prior->time_constant_min.size(), grid.size()));
}

}  // namespace

Result<void> SpectrumOptions::check() const {
    const auto refuse = [](std::string_view field, double found, std::string_view accepted) {
        return fail(NextStep::refuse_input, fmt::format("{} is {}, accepted is {}", field, found, accepted));
    };
    if (time_constants < 4 || time_constants > 200) {
        return refuse("time_constants", static_cast<double>(time_constants), "4 to 200");
    }
    if (!(fastest_min > 0.0)) return refuse("fastest_min", fastest_min, "above 0");
    if (!(slowest_min > fastest_min)) return refuse("slowest_min", slowest_min, "above fastest_min");
    if (!(block_min > 0.0)) return refuse("block_min", block_min, "above 0");
    if (!(falloff_min > 0.0)) return refuse("falloff_min", falloff_min, "above 0");
    if (!(weight_shape > 0.0)) return refuse("weight_shape", weight_shape, "above 0");
    if (!(base_level > 0.0)) return refuse("base_level", base_level, "above 0");
    if (!(base_shape > 0.0)) return refuse("base_shape", base_shape, "above 0");
    if (!(ambient_gain_sd > 0.0)) return refuse("ambient_gain_sd", ambient_gain_sd, "above 0");
    if (draws < 20) return refuse("draws", static_cast<double>(draws), "20 or more");
    return {};
}

Result<SpectrumEstimate> estimate_spectrum(const TestWindow& window, std::string_view ambient,
                                           const std::optional<SpectrumPrior>& prior,
                                           const SpectrumOptions& options, std::uint64_t seed,
                                           const std::vector<double>& start_level_C) {
    if (const Result<void> valid = options.check(); !valid) return std::unexpected(valid.error());
    if (!ambient.empty() && window.channel(ambient) == nullptr) {
        return fail(
            NextStep::refuse_input,
            fmt::format("the ambient channel {} is not in the window; name one that is, or none", ambient));
    }
    if (window.scans == 0 || (window.end_s() - window.start_s) < minimum_window_min * seconds_per_min) {
        return fail(NextStep::refuse_input, fmt::format("the window has {} scans; at least {} min are needed",
                                                        window.scans, minimum_window_min));
    }
    std::vector<std::size_t> structural;
    for (std::size_t i = 0; i < window.channels.size(); ++i) {
        if (window.channels[i].name != ambient) structural.push_back(i);
    }
    if (structural.empty()) return fail(NextStep::refuse_input, "the window has no structural channel");

    const AmbientInput room = ambient_input(window, ambient, options.ambient_tail_min);
    Basis basis{logarithmic_grid(options.fastest_min, options.slowest_min, options.time_constants),
                room.measured};
    if (const Result<void> fits = check_prior(prior, basis.time_constant_min); !fits) {
        return std::unexpected(fits.error());
    }
    const std::size_t per_block = scans_per_block(window, options);
    const Eigen::MatrixXd design = block_design(basis, window, room, per_block);
    std::vector<ReducedChannel> reduced = reduce_channels(design, window, structural, per_block);
    std::vector<std::size_t> used;
    std::vector<ReducedChannel> used_channels;
    for (std::size_t i = 0; i < reduced.size(); ++i) {
        if (reduced[i].good_samples < 16) continue;
        used.push_back(i);
        used_channels.push_back(reduced[i]);
    }
    const Eigen::VectorXd functional = steady_state_functional(basis, room);
    const SpectrumDraws draws =
        sample_spectrum(used_channels, basis, functional, weight_prior(basis, prior, options),
                        options.burn_in, options.draws, curve_draws, seed);
    const CurveGrid curves = curve_grid(basis, window, room, design, per_block);

    SpectrumEstimate estimate;
    estimate.time_constant_min = basis.time_constant_min;
    estimate.window_start_s = window.start_s;
    estimate.window_end_s = window.end_s();
    estimate.ambient_reference_C = room.reference_C;
    estimate.ambient_tail_C = room.tail_C;
    estimate.has_ambient = room.measured;
    estimate.blocks = static_cast<std::size_t>(design.rows());
    for (Eigen::Index j = 0; j < basis.grid(); ++j) {
        estimate.weight.push_back(std::exp(draws.log_weight_mean[j]));
        estimate.log_weight_sd.push_back(draws.log_weight_sd[j]);
    }
    Eigen::VectorXd amplitudes = Eigen::VectorXd::Zero(basis.grid());
    const double start_min = window.start_s / seconds_per_min;
    for (std::size_t k = 0; k < used.size(); ++k) {
        const ReducedChannel& data = used_channels[k];
        const ChannelDraws& channel_draws = draws.channels[k];
        ChannelEstimate channel;
        channel.channel = window.channels[structural[used[k]]].name;
        channel.good_samples = data.good_samples;
        channel.noise_C = std::sqrt(data.sample_variance);
        channel.resolution_C = data.resolution_C;
        channel.residual_rms_C = data.residual_rms_C;
        channel.variance_inflation = data.variance_inflation;
        double mean = 0.0;
        double second = 0.0;
        for (std::size_t d = 0; d < channel_draws.mean.size(); ++d) {
            mean += channel_draws.mean[d];
            second += channel_draws.mean[d] * channel_draws.mean[d] +
                      options.interval_widening * options.interval_widening * channel_draws.variance[d];
        }
        const auto count = static_cast<double>(channel_draws.mean.size());
        mean /= count;
        channel.steady_state_C = data.centre_C + mean;
        channel.steady_state_sd_C = std::sqrt(std::max(0.0, second / count - mean * mean));
        channel.steady_state_low_C =
            data.centre_C + mixture_quantile(channel_draws, options.interval_widening, 0.05);
        channel.steady_state_high_C =
            data.centre_C + mixture_quantile(channel_draws, options.interval_widening, 0.95);
        Eigen::VectorXd coefficients = channel_draws.coefficient_mean;
        const Eigen::VectorXd curve = curves.design * coefficients;
        coefficients[0] += data.centre_C;
        channel.coefficients.assign(coefficients.begin(), coefficients.end());
        channel.start_C = coefficients[0];
        channel.last_C = data.centre_C + curve[design.rows()];
        const double given = start_level_C.empty() ? no_value : start_level_C[structural[used[k]]];
        const double start_level = std::isnan(given) ? channel.start_C : given;
        channel.rise_C = channel.steady_state_C - start_level;
        std::vector<double> times;
        for (Eigen::Index d = 0; d < channel_draws.coefficients.cols(); ++d) {
            const Eigen::VectorXd draw = channel_draws.coefficients.col(d);
            const double own_start = std::isnan(given) ? draw[0] : given - data.centre_C;
            times.push_back(start_min + crossing_time(curves.minute, curves.design * draw, own_start,
                                                      functional.dot(draw)));
        }
        channel.equilibrium_time_min =
            start_min + crossing_time(curves.minute, curve, start_level - data.centre_C, mean);
        channel.equilibrium_low_min = std::min(sorted_quantile(times, 0.05), channel.equilibrium_time_min);
        channel.equilibrium_high_min = std::max(sorted_quantile(times, 0.95), channel.equilibrium_time_min);
        const Eigen::VectorXd own = channel_draws.coefficient_mean.segment(1, basis.grid());
        channel.slowest_time_constant_min = slowest_carrying(basis.time_constant_min, own);
        amplitudes += own.cwiseAbs();
        estimate.channels.push_back(std::move(channel));
    }
    estimate.slowest_time_constant_min = slowest_carrying(basis.time_constant_min, amplitudes);
    return estimate;
}

std::vector<double> predict_curve(const SpectrumEstimate& estimate, const ChannelEstimate& channel,
                                  const TestWindow& window, std::string_view ambient,
                                  const std::vector<double>& time_s) {
    const TestWindow fitted =
        window_from(window_until(window, estimate.window_end_s), estimate.window_start_s);
    const AmbientInput room =
        ambient_input(fitted, estimate.has_ambient ? ambient : std::string_view{}, 15.0);
    const Basis basis{estimate.time_constant_min, estimate.has_ambient};
    const Eigen::MatrixXd inside = block_design(basis, fitted, room, 1);
    const Eigen::VectorXd coefficients = Eigen::Map<const Eigen::VectorXd>(
        channel.coefficients.data(), static_cast<Eigen::Index>(channel.coefficients.size()));
    const Eigen::VectorXd past = inside * coefficients;
    std::vector<double> after;
    for (const double time : time_s)
        after.push_back(std::max(0.0, (time - fitted.end_s()) / seconds_per_min));
    const Eigen::VectorXd future = future_design(basis, fitted, room, after) * coefficients;
    std::vector<double> curve;
    for (std::size_t k = 0; k < time_s.size(); ++k) {
        const double position = (time_s[k] - fitted.start_s) / fitted.period_s;
        if (position >= static_cast<double>(fitted.scans - 1)) {
            curve.push_back(future[static_cast<Eigen::Index>(k)]);
            continue;
        }
        const auto scan = static_cast<Eigen::Index>(std::max(0.0, std::floor(position)));
        const double share = std::clamp(position - static_cast<double>(scan), 0.0, 1.0);
        curve.push_back((1.0 - share) * past[scan] + share * past[scan + 1]);
    }
    return curve;
}

}  // namespace thermbal
