#include "channel_draws.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/units.hpp"
#include "random.hpp"

namespace thermbal {

namespace {

constexpr std::size_t curve_draws = 60;
constexpr double settled_share = 0.95;

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

/// Spreads one value a mode over the two grid points about each mode.
void add_on_grid(const std::vector<Mode>& modes, const Eigen::VectorXd& value, double factor,
                 Eigen::VectorXd& grid) {
    for (std::size_t k = 0; k < modes.size(); ++k) {
        const GridCell cell = cell_of(modes[k].position, grid.size());
        const auto index = static_cast<Eigen::Index>(k);
        grid[cell.below] += factor * (1.0 - cell.share) * value[index];
        grid[cell.below + 1] += factor * cell.share * value[index];
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

CurveGrid curve_grid(const SpectrumProblem& problem) {
    CurveGrid grid;
    const TestWindow& window = problem.window;
    const double period_min = window.period_s / seconds_per_min;
    for (Eigen::Index row = 0; row < problem.design.rows(); ++row) {
        const auto first = static_cast<std::size_t>(row) * problem.scans_per_block;
        const std::size_t last = std::min(first + problem.scans_per_block, window.scans);
        grid.minute.push_back(0.5 * static_cast<double>(first + last - 1) * period_min);
    }
    std::vector<double> after{0.0};
    for (double step = 0.5; step < 6000.0; step *= 1.08) after.push_back(step);
    const double end_min = static_cast<double>(window.scans - 1) * period_min;
    for (const double value : after) grid.minute.push_back(end_min + value);
    const Eigen::MatrixXd future = future_design(problem.basis, window, problem.room, after);
    grid.design.resize(problem.design.rows() + future.rows(), problem.basis.size());
    grid.design << problem.design, future;
    grid.fine = step_columns(problem.fine_grid, grid.minute);
    return grid;
}

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

double ChannelDraws::steady_state() const {
    return std::accumulate(mean.begin(), mean.end(), 0.0) / static_cast<double>(mean.size());
}

double ChannelDraws::standard_deviation() const {
    double second = 0.0;
    for (std::size_t d = 0; d < mean.size(); ++d) second += mean[d] * mean[d] + variance[d];
    const double centre = steady_state();
    return std::sqrt(std::max(0.0, second / static_cast<double>(mean.size()) - centre * centre));
}

double ChannelDraws::half_width_of_90_percent() const {
    return 0.5 * (mixture_quantile(*this, 0.95) - mixture_quantile(*this, 0.05));
}

Eigen::VectorXd background_curve(const BackgroundAmplitudes& amplitudes, const CurveGrid& curves) {
    Eigen::VectorXd curve = curves.design * amplitudes.of_basis;
    if (amplitudes.of_modes.size() > 0) curve += curves.fine * amplitudes.of_modes;
    return curve;
}

BackgroundAmplitudes spread_responses(const ObservedChannel& channel, const Basis& basis,
                                      const Eigen::VectorXd& background) {
    BackgroundAmplitudes spread{background.head(basis.size()), {}};
    if (channel.responses.cols() == 0) return spread;
    const Eigen::VectorXd response = channel.responses * background.tail(channel.responses.cols());
    spread.of_basis.segment(1, basis.grid()) += response.head(basis.grid());
    spread.of_modes = response.tail(response.size() - basis.grid());
    return spread;
}

SpectrumDraws draw_channels(const SpectrumProblem& problem, std::vector<ChannelModel>& models,
                            const std::vector<std::vector<Mode>>& states, const CurveGrid& curves,
                            std::uint64_t seed) {
    Random random(seed ^ 0x5DEECE66DULL);
    const auto grid = static_cast<Eigen::Index>(problem.fine_grid.size());
    SpectrumDraws draws;
    draws.density = Eigen::VectorXd::Zero(grid);
    draws.log_variance = Eigen::VectorXd::Zero(grid);
    for (const ObservedChannel& channel : problem.channels) {
        ChannelDraws& each = draws.channels.emplace_back();
        each.background = Eigen::VectorXd::Zero(problem.basis.size() + channel.responses.cols());
        each.fine = Eigen::VectorXd::Zero(grid);
    }
    const double share = 1.0 / static_cast<double>(states.size());
    const std::size_t curve_every = std::max<std::size_t>(1, states.size() / curve_draws);
    const double start_min = problem.window.start_s / seconds_per_min;
    for (std::size_t state = 0; state < states.size(); ++state) {
        const std::vector<Mode>& modes = states[state];
        const ModeAmplitudes amplitudes = relative_amplitudes(modes, problem.modes, problem.direction);
        const auto count = static_cast<Eigen::Index>(modes.size());
        Eigen::VectorXd logs(count);
        for (Eigen::Index k = 0; k < count; ++k) logs[k] = modes[static_cast<std::size_t>(k)].log_variance;
        add_on_grid(modes, Eigen::VectorXd::Ones(count), share, draws.density);
        add_on_grid(modes, logs, share, draws.log_variance);
        draws.mode_energy.push_back(logs.array().exp().sum());
        const bool with_curve = state % curve_every == 0;
        const Eigen::MatrixXd steps =
            with_curve ? mode_curves(modes, problem.modes, curves.minute) : Eigen::MatrixXd();
        for (std::size_t k = 0; k < models.size(); ++k) {
            ChannelModel& model = models[k];
            ChannelDraws& channel = draws.channels[k];
            model.condition_on(model.columns_at(modes), amplitudes);
            const ConditionalValue value = model.steady_state();
            channel.mean.push_back(value.mean);
            channel.variance.push_back(value.variance);
            channel.background += share * model.mean_background();
            add_on_grid(modes, model.mean_modes(), share, channel.fine);
            if (!with_curve) continue;
            const Eigen::VectorXd sample = model.draw(random);
            const ObservedChannel& observed = problem.channels[k];
            const Eigen::VectorXd curve =
                background_curve(
                    spread_responses(observed, problem.basis, sample.head(sample.size() - count)), curves) +
                steps * sample.tail(count);
            const double start = std::isnan(observed.test_start_C)
                                     ? sample[0]
                                     : observed.test_start_C - observed.data.centre_C;
            channel.equilibrium_min.push_back(
                start_min + crossing_time(curves.minute, curve, start, model.settled(sample)));
        }
    }
    for (Eigen::Index g = 0; g < grid; ++g) {
        draws.log_variance[g] = draws.density[g] > 0.0 ? draws.log_variance[g] / draws.density[g]
                                                       : problem.modes.log_variance_mean[g];
    }
    return draws;
}

}  // namespace thermbal
