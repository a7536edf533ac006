#include "spectrum_problem.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/median.hpp"
#include "base/units.hpp"
#include "generic_prior.hpp"
#include "series/sample.hpp"
#include "shared_response.hpp"

namespace thermbal {

namespace {

constexpr double minimum_window_min = 8.0;
constexpr std::size_t fewest_good_samples = 16;

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

Eigen::VectorXd steady_state_functional(const Basis& basis, const AmbientInput& ambient) {
    Eigen::VectorXd functional = Eigen::VectorXd::Ones(basis.size());
    if (basis.has_ambient) functional.tail(basis.grid()).setConstant(ambient.tail_C - ambient.reference_C);
    return functional;
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

/// +1 if all channels warm, -1 if all cool, towards 0 as they disagree: then nothing is said about signs.
double common_direction(const std::vector<ObservedChannel>& channels) {
    constexpr double disagreement = 0.6;
    double net = 0.0;
    double total = 0.0;
    for (const ObservedChannel& channel : channels) {
        net += channel.data.change_C;
        total += std::abs(channel.data.change_C);
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

Result<void> check_inputs(const TestWindow& recorded, std::string_view ambient,
                          const std::optional<SpectrumPrior>& prior, const SpectrumOptions& options) {
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
    return check_prior(prior, options);
}

/// The structural channels, those with too few good samples left out.
Result<std::vector<ObservedChannel>> observed_channels(const SpectrumProblem& problem,
                                                       std::string_view ambient,
                                                       const std::vector<double>& start_level_C) {
    const TestWindow& window = problem.window;
    std::vector<std::size_t> structural;
    for (std::size_t i = 0; i < window.channels.size(); ++i) {
        if (window.channels[i].name != ambient) structural.push_back(i);
    }
    if (structural.empty()) return fail(NextStep::refuse_input, "the window has no structural channel");
    std::vector<ReducedChannel> reduced =
        reduce_channels(problem.design, block_steps(problem.fine_grid, window, problem.scans_per_block),
                        window, structural, problem.scans_per_block);
    std::vector<ObservedChannel> channels;
    for (std::size_t k = 0; k < structural.size(); ++k) {
        if (reduced[k].good_samples < fewest_good_samples) continue;
        ObservedChannel channel;
        channel.name = window.channels[structural[k]].name;
        channel.data = std::move(reduced[k]);
        channel.test_start_C = start_level_C.empty() ? no_value : start_level_C[structural[k]];
        channels.push_back(std::move(channel));
    }
    if (channels.empty()) {
        return fail(
            NextStep::refuse_input,
            fmt::format("no structural channel has {} good samples in the window", fewest_good_samples));
    }
    return channels;
}

double room_moved_before(const SpectrumProblem& problem, std::string_view ambient,
                         const std::vector<double>& start_level_C) {
    if (!problem.room.measured || start_level_C.empty()) return 0.0;
    const auto room = std::ranges::find(problem.window.channels, ambient, &Column::name);
    const double start_C = start_level_C[static_cast<std::size_t>(room - problem.window.channels.begin())];
    return std::isfinite(start_C) ? problem.room.reference_C - start_C : 0.0;
}

/// A sensor far from the heat is flat at first because its modes cancel, not because they are small: no
/// channel's scale is far below that of the others.
void give_scales(std::vector<ObservedChannel>& channels, double scale_floor) {
    std::vector<double> ranges_C;
    ranges_C.reserve(channels.size());
    for (const ObservedChannel& channel : channels) ranges_C.push_back(channel.data.range_C);
    const double common_C = scale_floor * upper_median(ranges_C);
    for (ObservedChannel& channel : channels) {
        channel.scale_C = std::sqrt(channel.data.range_C * channel.data.range_C + common_C * common_C +
                                    9.0 * channel.data.sample_variance);
    }
}

double mode_scale_C(const ObservedChannel& channel, const SpectrumOptions& options) {
    return channel.responses.cols() > 0 ? options.archive_deviation * channel.scale_C : channel.scale_C;
}

/// How this test mixes the earlier tests' responses is found from all channels together.
void mix_responses_alike(const SpectrumOptions& options, SpectrumProblem& problem) {
    std::vector<RespondingChannel> responding;
    responding.reserve(problem.channels.size());
    for (const ObservedChannel& channel : problem.channels) {
        responding.push_back(responding_channel(channel.data, problem.basis, problem.background,
                                                channel.responses, channel.scale_C,
                                                mode_scale_C(channel, options), problem.modes));
    }
    const std::vector<MixtureBelief> beliefs = common_mixture(responding, options.mixture);
    for (std::size_t k = 0; k < beliefs.size(); ++k) {
        problem.channels[k].responses = moved_responses(problem.channels[k].responses, beliefs[k]);
    }
}

}  // namespace

Result<SpectrumProblem> pose_problem(const TestWindow& recorded, std::string_view ambient,
                                     const std::optional<SpectrumPrior>& prior,
                                     const SpectrumOptions& options,
                                     const std::vector<double>& start_level_C) {
    if (const Result<void> sound = check_inputs(recorded, ambient, prior, options); !sound) {
        return std::unexpected(sound.error());
    }
    SpectrumProblem problem;
    problem.window = without_spikes(recorded);
    problem.room = ambient_input(problem.window, ambient, options.ambient_tail_min);
    problem.room_before_C = room_moved_before(problem, ambient, start_level_C);
    problem.basis = {logarithmic_grid(options.fastest_min, options.slowest_min, options.background_points),
                     problem.room.measured};
    problem.fine_grid = logarithmic_grid(options.fastest_min, options.slowest_min, options.grid);
    problem.scans_per_block = scans_per_block(problem.window, options);
    problem.design = block_design(problem.basis, problem.window, problem.room, problem.scans_per_block);
    Result<std::vector<ObservedChannel>> channels = observed_channels(problem, ambient, start_level_C);
    if (!channels) return std::unexpected(channels.error());
    problem.channels = std::move(*channels);
    give_scales(problem.channels, options.scale_floor);
    problem.functional = steady_state_functional(problem.basis, problem.room);
    problem.background = background_prior(problem.basis, options);
    problem.modes = mode_prior(prior, options);
    problem.direction = common_direction(problem.channels);
    // After a regime change the channels start out of equilibrium: what they did from cold does not apply.
    if (prior && start_level_C.empty()) {
        for (ObservedChannel& channel : problem.channels)
            channel.responses = archived_responses(prior, channel.name);
        mix_responses_alike(options, problem);
    }
    return problem;
}

std::vector<ChannelModel> channel_models(const SpectrumProblem& problem, const SpectrumOptions& options) {
    std::vector<ChannelModel> models;
    for (const ObservedChannel& channel : problem.channels) {
        BackgroundPrior background = problem.background;
        background.responses = channel.responses;
        models.emplace_back(channel.data, problem.basis, background, channel.scale_C,
                            mode_scale_C(channel, options), problem.functional);
    }
    return models;
}

std::vector<std::vector<Mode>> mode_states(const SpectrumProblem& problem,
                                           const std::vector<ChannelModel>& models,
                                           const SpectrumOptions& options, std::size_t kept,
                                           std::uint64_t seed) {
    std::vector<WhitenedChannel> whitened;
    whitened.reserve(models.size());
    for (const ChannelModel& model : models) whitened.push_back(model.whitened(problem.direction));
    return sample_modes(whitened, problem.modes, options.burn_in, kept, options.thinning, seed);
}

void tie_room_to_modes(const std::vector<std::vector<Mode>>& states, const SpectrumOptions& options,
                       SpectrumProblem& problem) {
    const Basis& basis = problem.basis;
    const ModePrior& prior = problem.modes;
    BackgroundPrior& background = problem.background;
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

}  // namespace thermbal
