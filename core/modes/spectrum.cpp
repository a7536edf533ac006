#include "modes/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "channel_model.hpp"
#include "design.hpp"
#include "generic_prior.hpp"
#include "mode_sampler.hpp"
#include "random.hpp"
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

ModePrior mode_prior(const std::optional<SpectrumPrior>& archive, const SpectrumOptions& options) {
    const GenericPrior generic = generic_prior(options);
    const std::vector<double>& grid = generic.time_constant_min;
    const auto vector_of = [](const std::vector<double>& values) {
        return Eigen::VectorXd(
            Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())));
    };
    ModePrior prior;
    prior.log_tau = vector_of(grid).array().log();
    prior.intensity = vector_of(archive ? archive->intensity : generic.intensity);
    prior.log_variance_mean = vector_of(archive ? archive->log_variance_mean : generic.log_variance_mean);
    prior.log_variance_sd = vector_of(archive ? archive->log_variance_sd : generic.log_variance_sd);
    prior.same_sign.resize(prior.log_tau.size());
    for (std::size_t g = 0; g < grid.size(); ++g) {
        const double ratio = options.same_sign_min / grid[g];
        prior.same_sign[static_cast<Eigen::Index>(g)] = options.same_sign / (1.0 + ratio * ratio);
    }
    return prior;
}

BackgroundPrior background_prior(const Basis& basis, const SpectrumOptions& options) {
    const Eigen::Index grid = basis.grid();
    BackgroundPrior prior;
    prior.level_profile.resize(grid);
    prior.ambient_gain_sd = options.ambient_gain_sd;
    prior.ambient_gain_loss_per_C = options.ambient_gain_loss_per_C;
    for (Eigen::Index j = 0; j < grid; ++j) {
        const double tau = basis.time_constant_min[static_cast<std::size_t>(j)];
        const double falloff =
            tau > options.falloff_min ? std::pow(options.falloff_min / tau, options.falloff_power) : 1.0;
        prior.level_profile[j] = options.background_level * falloff;
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

/// A channel's steady state as the sampling leaves it: an equal mixture of normals, and amplitude draws for
/// its curve.
struct ChannelDraws {
    std::vector<double> mean;
    std::vector<double> variance;
    Eigen::VectorXd background;  // posterior mean coefficients of the basis
    Eigen::VectorXd fine;        // posterior mean amplitudes on the modes' grid
    std::vector<double> equilibrium_min;
};

Eigen::VectorXd steady_state_functional(const Basis& basis, const AmbientInput& ambient) {
    Eigen::VectorXd functional = Eigen::VectorXd::Ones(basis.size());
    if (basis.has_ambient) functional.tail(basis.grid()).setConstant(ambient.tail_C - ambient.reference_C);
    return functional;
}

/// Quantile of an equal mixture of normals, by bisection.
double mixture_quantile(const ChannelDraws& draws, double probability) {
    double low = draws.mean.front();
    double high = low;
    for (std::size_t k = 0; k < draws.mean.size(); ++k) {
        const double reach = 8.0 * std::sqrt(draws.variance[k]) + 1e-9;
        low = std::min(low, draws.mean[k] - reach);
        high = std::max(high, draws.mean[k] + reach);
    }
    for (int step = 0; step < 60; ++step) {
        const double middle = 0.5 * (low + high);
        double below = 0.0;
        for (std::size_t k = 0; k < draws.mean.size(); ++k) {
            const double sd = std::sqrt(draws.variance[k]) + 1e-12;
            below += 0.5 * std::erfc((draws.mean[k] - middle) / (sd * std::sqrt(2.0)));
        }
        (below / static_cast<double>(draws.mean.size()) < probability ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

/// Minutes of the prediction grid: inside the window coarsely, beyond it on a geometric grid.
struct CurveGrid {
    std::vector<double> minute;  ///< since the window's start
    Eigen::MatrixXd design;      ///< of the basis
    Eigen::MatrixXd fine;        ///< step columns of the modes' grid
};

Eigen::MatrixXd step_columns(const std::vector<double>& time_constant_min,
                             const std::vector<double>& minute) {
    Eigen::MatrixXd columns(static_cast<Eigen::Index>(minute.size()),
                            static_cast<Eigen::Index>(time_constant_min.size()));
    for (std::size_t j = 0; j < time_constant_min.size(); ++j) {
        for (std::size_t row = 0; row < minute.size(); ++row) {
            columns(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(j)) =
                -std::expm1(-minute[row] / time_constant_min[j]);
        }
    }
    return columns;
}

CurveGrid curve_grid(const Basis& basis, const TestWindow& window, const AmbientInput& ambient,
                     const Eigen::MatrixXd& blocks, std::size_t per_block,
                     const std::vector<double>& fine_grid) {
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
    grid.fine = step_columns(fine_grid, grid.minute);
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

Result<void> check_prior(const std::optional<SpectrumPrior>& prior, const SpectrumOptions& options) {
    if (!prior) return {};
    const std::size_t points = options.grid;
    const bool fits = prior->time_constant_min.size() == points && prior->intensity.size() == points &&
                      prior->log_variance_mean.size() == points && prior->log_variance_sd.size() == points &&
                      std::abs(prior->time_constant_min.front() / options.fastest_min - 1.0) < 1e-6 &&
                      std::abs(prior->time_constant_min.back() / options.slowest_min - 1.0) < 1e-6;
    if (fits) return {};
    return fail(
        NextStep::refuse_input,
        fmt::format(
            "the archive's spectrum has {} time constants, the options ask for {}: learn it again from "
            "the stored tests",
            prior->time_constant_min.size(), points));
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
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

/// The machine answers the room through the same modes as the heat: the response to the room is expected
/// where the modes are found, slow ones most.
void tie_ambient_to_modes(const std::vector<std::vector<Mode>>& states, const ModePrior& prior,
                          const Basis& basis, const SpectrumOptions& options, BackgroundPrior& background) {
    const double spacing = prior.log_tau[1] - prior.log_tau[0];
    const double cell = std::log(basis.time_constant_min[1] / basis.time_constant_min[0]);
    Eigen::VectorXd found = Eigen::VectorXd::Zero(basis.grid());
    for (const std::vector<Mode>& modes : states) {
        for (const Mode& mode : modes) {
            const double log_tau = prior.log_tau[0] + spacing * mode.position;
            for (Eigen::Index j = 0; j < basis.grid(); ++j) {
                const double z =
                    (std::log(basis.time_constant_min[static_cast<std::size_t>(j)]) - log_tau) / cell;
                found[j] += std::exp(0.5 * mode.log_variance - 0.5 * z * z);
            }
        }
    }
    if (!(found.sum() > 0.0)) return;
    found /= found.sum();
    background.ambient_mean =
        options.ambient_modes_share * found + (1.0 - options.ambient_modes_share) * background.ambient_mean;
    background.ambient_variance = 0.5 * background.ambient_mean;
}

/// +1 if all channels warm, -1 if all cool, towards 0 as they disagree: then nothing is said about signs.
double common_direction(const std::vector<ReducedChannel>& channels, const std::vector<std::size_t>& used) {
    constexpr double disagreement = 0.6;
    double net = 0.0;
    double total = 0.0;
    for (const std::size_t i : used) {
        net += channels[i].change_C;
        total += std::abs(channels[i].change_C);
    }
    if (total == 0.0) return 0.0;
    const double agreement = std::abs(net) / total;
    return std::copysign(std::max(0.0, (agreement - disagreement) / (1.0 - disagreement)), net);
}

Eigen::MatrixXd archived_responses(const std::optional<SpectrumPrior>& prior, const std::string& channel) {
    if (!prior) return {};
    for (const SpectrumPrior::Response& response : prior->responses) {
        if (response.channel != channel || response.shape.empty()) continue;
        Eigen::MatrixXd columns(static_cast<Eigen::Index>(response.shape.front().size()),
                                static_cast<Eigen::Index>(response.shape.size()));
        for (std::size_t k = 0; k < response.shape.size(); ++k) {
            columns.col(static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::VectorXd>(
                response.shape[k].data(), static_cast<Eigen::Index>(response.shape[k].size()));
        }
        return columns;
    }
    return {};
}

/// Spreads one value a mode over the two grid points about each mode.
void add_on_grid(const std::vector<Mode>& modes, const Eigen::VectorXd& value, double factor,
                 Eigen::VectorXd& grid) {
    for (std::size_t k = 0; k < modes.size(); ++k) {
        const auto below = std::min(static_cast<Eigen::Index>(modes[k].position), grid.size() - 2);
        const double share = modes[k].position - static_cast<double>(below);
        grid[below] += factor * (1.0 - share) * value[static_cast<Eigen::Index>(k)];
        grid[below + 1] += factor * share * value[static_cast<Eigen::Index>(k)];
    }
}

/// Step columns of the modes at the minutes of a curve.
Eigen::MatrixXd mode_curves(const std::vector<Mode>& modes, const ModePrior& prior,
                            const std::vector<double>& minute) {
    const double spacing = prior.log_tau[1] - prior.log_tau[0];
    std::vector<double> tau;
    tau.reserve(modes.size());
    for (const Mode& mode : modes) tau.push_back(std::exp(prior.log_tau[0] + spacing * mode.position));
    return step_columns(tau, minute);
}

}  // namespace

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

Result<SpectrumEstimate> estimate_spectrum(const TestWindow& recorded, std::string_view ambient,
                                           const std::optional<SpectrumPrior>& prior,
                                           const SpectrumOptions& options, std::uint64_t seed,
                                           const std::vector<double>& start_level_C) {
    if (const Result<void> valid = options.check(); !valid) return std::unexpected(valid.error());
    if (!ambient.empty() && recorded.channel(ambient) == nullptr) {
        return fail(
            NextStep::refuse_input,
            fmt::format("the ambient channel {} is not in the window; name one that is, or none", ambient));
    }
    if (recorded.scans == 0 || (recorded.end_s() - recorded.start_s) < minimum_window_min * seconds_per_min) {
        return fail(NextStep::refuse_input, fmt::format("the window has {} scans; at least {} min are needed",
                                                        recorded.scans, minimum_window_min));
    }
    std::vector<std::size_t> structural;
    for (std::size_t i = 0; i < recorded.channels.size(); ++i) {
        if (recorded.channels[i].name != ambient) structural.push_back(i);
    }
    if (structural.empty()) return fail(NextStep::refuse_input, "the window has no structural channel");

    const TestWindow window = without_spikes(recorded);
    const AmbientInput room = ambient_input(window, ambient, options.ambient_tail_min);
    const Basis basis{logarithmic_grid(options.fastest_min, options.slowest_min, options.background_points),
                      room.measured};
    if (const Result<void> fits = check_prior(prior, options); !fits) return std::unexpected(fits.error());
    const std::vector<double> fine_grid =
        logarithmic_grid(options.fastest_min, options.slowest_min, options.grid);
    const std::size_t per_block = scans_per_block(window, options);
    const Eigen::MatrixXd design = block_design(basis, window, room, per_block);
    const std::vector<ReducedChannel> reduced =
        reduce_channels(design, block_steps(fine_grid, window, per_block), window, structural, per_block);
    std::vector<std::size_t> used;
    std::vector<double> ranges;
    for (std::size_t i = 0; i < reduced.size(); ++i) {
        if (reduced[i].good_samples < 16) continue;
        used.push_back(i);
        ranges.push_back(reduced[i].range_C);
    }
    if (used.empty())
        return fail(NextStep::refuse_input, "no structural channel has 16 good samples in the window");
    // A sensor far from the heat is flat at first because its modes cancel, not because they are small.
    const double common = options.scale_floor * median(ranges);
    const Eigen::VectorXd functional = steady_state_functional(basis, room);
    BackgroundPrior background = background_prior(basis, options);
    const ModePrior modes_prior = mode_prior(prior, options);
    const double direction = common_direction(reduced, used);
    std::vector<Eigen::MatrixXd> responses;
    std::vector<double> scales;
    for (const std::size_t i : used) {
        scales.push_back(std::sqrt(reduced[i].range_C * reduced[i].range_C + common * common +
                                   9.0 * reduced[i].sample_variance));
        // After a regime change the channels start out of equilibrium: what they did from cold does not
        // apply.
        responses.push_back(start_level_C.empty()
                                ? archived_responses(prior, window.channels[structural[i]].name)
                                : Eigen::MatrixXd());
    }
    const auto modelled = [&] {
        std::vector<ChannelModel> built;
        for (std::size_t k = 0; k < used.size(); ++k) {
            background.responses = responses[k];
            const double mode_scale =
                responses[k].cols() > 0 ? options.archive_deviation * scales[k] : scales[k];
            built.emplace_back(reduced[used[k]], basis, background, scales[k], mode_scale, functional);
        }
        return built;
    };
    const auto sampled = [&](const std::vector<ChannelModel>& built, std::size_t kept) {
        std::vector<WhitenedChannel> whitened;
        whitened.reserve(built.size());
        for (const ChannelModel& model : built) whitened.push_back(model.whitened(direction));
        return sample_modes(whitened, modes_prior, options.burn_in, kept, options.thinning, seed);
    };
    std::vector<ChannelModel> models = modelled();
    if (room.measured && room.range_C() > options.ambient_matters_C) {
        const std::vector<std::vector<Mode>> first = sampled(models, options.draws / 4);
        tie_ambient_to_modes(first, modes_prior, basis, options, background);
        models = modelled();
    }
    const std::vector<std::vector<Mode>> states = sampled(models, options.draws);
    const CurveGrid curves = curve_grid(basis, window, room, design, per_block, fine_grid);

    Random random(seed ^ 0x5DEECE66DULL);
    std::vector<ChannelDraws> draws(used.size());
    std::vector<Eigen::MatrixXd> linear_curves(used.size());  // of basis and archived responses
    for (std::size_t k = 0; k < used.size(); ++k) {
        const Eigen::Index columns = basis.size() + responses[k].cols();
        draws[k].background = Eigen::VectorXd::Zero(columns);
        draws[k].fine = Eigen::VectorXd::Zero(modes_prior.log_tau.size());
        linear_curves[k].resize(curves.design.rows(), columns);
        linear_curves[k].leftCols(basis.size()) = curves.design;
        if (responses[k].cols() == 0) continue;
        linear_curves[k].rightCols(responses[k].cols()) =
            curves.design.middleCols(1, basis.grid()) * responses[k].topRows(basis.grid()) +
            curves.fine * responses[k].bottomRows(curves.fine.cols());
    }
    std::vector<double> energies;
    Eigen::VectorXd density = Eigen::VectorXd::Zero(modes_prior.log_tau.size());
    Eigen::VectorXd log_variance = Eigen::VectorXd::Zero(modes_prior.log_tau.size());
    const double share = 1.0 / static_cast<double>(states.size());
    const std::size_t curve_every = std::max<std::size_t>(1, states.size() / curve_draws);
    const double start_min = window.start_s / seconds_per_min;
    for (std::size_t state = 0; state < states.size(); ++state) {
        const std::vector<Mode>& modes = states[state];
        const ModeAmplitudes amplitudes = relative_amplitudes(modes, modes_prior, direction);
        const auto count = static_cast<Eigen::Index>(modes.size());
        Eigen::VectorXd logs(count);
        for (Eigen::Index k = 0; k < count; ++k) logs[k] = modes[static_cast<std::size_t>(k)].log_variance;
        add_on_grid(modes, Eigen::VectorXd::Ones(count), share, density);
        add_on_grid(modes, logs, share, log_variance);
        energies.push_back(logs.array().exp().sum());
        const bool with_curve = state % curve_every == 0;
        const Eigen::MatrixXd steps =
            with_curve ? mode_curves(modes, modes_prior, curves.minute) : Eigen::MatrixXd();
        for (std::size_t k = 0; k < used.size(); ++k) {
            ChannelModel& model = models[k];
            model.condition_on(model.columns_at(modes), amplitudes);
            const ConditionalValue value = model.steady_state();
            draws[k].mean.push_back(value.mean);
            draws[k].variance.push_back(value.variance);

            draws[k].background += share * model.mean_background();
            add_on_grid(modes, model.mean_modes(), share, draws[k].fine);
            if (!with_curve) continue;
            const Eigen::VectorXd sample = model.draw(random);
            const Eigen::Index linear = linear_curves[k].cols();
            const Eigen::VectorXd curve = linear_curves[k] * sample.head(linear) + steps * sample.tail(count);
            const double settled = model.settled(sample);
            const double given = start_level_C.empty()
                                     ? no_value
                                     : start_level_C[structural[used[k]]] - reduced[used[k]].centre_C;
            draws[k].equilibrium_min.push_back(
                start_min +
                crossing_time(curves.minute, curve, std::isnan(given) ? sample[0] : given, settled));
        }
    }

    const double factor = prior || !start_level_C.empty() ? 1.0 : options.interval_factor;
    const double floor = std::hypot(options.model_floor_C,
                                    options.room_floor * range_over_the_last_hour_C(room, window.period_s));
    SpectrumEstimate estimate;
    estimate.time_constant_min = fine_grid;
    estimate.background_time_constant_min = basis.time_constant_min;
    for (Eigen::Index g = 0; g < density.size(); ++g) {
        estimate.mode_density.push_back(density[g]);
        estimate.mode_log_variance.push_back(density[g] > 0.0 ? log_variance[g] / density[g]
                                                              : modes_prior.log_variance_mean[g]);
    }
    estimate.expected_modes = density.sum();
    estimate.mode_energy = sorted_quantile(energies, 0.5);
    estimate.used_responses = std::any_of(responses.begin(), responses.end(),
                                          [](const Eigen::MatrixXd& each) { return each.cols() > 0; });
    estimate.window_start_s = window.start_s;
    estimate.window_end_s = window.end_s();
    estimate.ambient_reference_C = room.reference_C;
    estimate.ambient_tail_C = room.tail_C;
    estimate.has_ambient = room.measured;
    estimate.blocks = static_cast<std::size_t>(design.rows());
    Eigen::VectorXd amplitudes = Eigen::VectorXd::Zero(modes_prior.log_tau.size());
    for (std::size_t k = 0; k < used.size(); ++k) {
        const ReducedChannel& data = reduced[used[k]];
        const ChannelDraws& channel_draws = draws[k];
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
            second += channel_draws.mean[d] * channel_draws.mean[d] + channel_draws.variance[d];
        }
        const auto count = static_cast<double>(channel_draws.mean.size());
        mean /= count;
        channel.steady_state_C = data.centre_C + mean;
        // A skewed posterior can have a narrow 90 % and a long tail: the wider of the two counts.
        constexpr double sds_of_90_percent = 1.645;
        const double sd = std::sqrt(std::max(0.0, second / count - mean * mean));
        const double quantiles_apart =
            mixture_quantile(channel_draws, 0.95) - mixture_quantile(channel_draws, 0.05);
        const double half =
            std::hypot(factor * std::max(0.5 * quantiles_apart, sds_of_90_percent * sd), floor);
        channel.steady_state_sd_C = std::hypot(factor * sd, floor / sds_of_90_percent);
        channel.steady_state_low_C = channel.steady_state_C - half;
        channel.steady_state_high_C = channel.steady_state_C + half;
        const Eigen::VectorXd curve =
            linear_curves[k] * channel_draws.background + curves.fine * channel_draws.fine;
        Eigen::VectorXd coefficients(basis.size() + channel_draws.fine.size());
        coefficients << channel_draws.background.head(basis.size()), channel_draws.fine;
        if (responses[k].cols() > 0) {
            const Eigen::VectorXd response =
                responses[k] * channel_draws.background.tail(responses[k].cols());
            coefficients.segment(1, basis.grid()) += response.head(basis.grid());
            coefficients.tail(channel_draws.fine.size()) += response.tail(channel_draws.fine.size());
        }
        coefficients[0] += data.centre_C;
        channel.coefficients.assign(coefficients.begin(), coefficients.end());
        channel.start_C = coefficients[0];
        channel.last_C = data.centre_C + curve[design.rows()];
        const double given = start_level_C.empty() ? no_value : start_level_C[structural[used[k]]];
        const double start_level = std::isnan(given) ? channel.start_C : given;
        channel.rise_C = channel.steady_state_C - start_level;
        const std::vector<double>& times = channel_draws.equilibrium_min;
        channel.equilibrium_time_min =
            start_min + crossing_time(curves.minute, curve, start_level - data.centre_C, mean);
        channel.equilibrium_low_min = std::min(sorted_quantile(times, 0.05), channel.equilibrium_time_min);
        channel.equilibrium_high_min = std::max(sorted_quantile(times, 0.95), channel.equilibrium_time_min);
        const Eigen::VectorXd own = coefficients.tail(channel_draws.fine.size());
        channel.slowest_time_constant_min = slowest_carrying(fine_grid, own);
        amplitudes += own.cwiseAbs();
        estimate.channels.push_back(std::move(channel));
    }
    estimate.slowest_time_constant_min = slowest_carrying(fine_grid, amplitudes);
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
