#include "declaration/compare.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "channel_sweep.hpp"
#include "guards.hpp"
#include "kalman_prediction.hpp"
#include "modes/exponentials.hpp"
#include "regression/sweep.hpp"
#include "series/sample.hpp"

namespace thermbal {
namespace {

using Answers = std::vector<EstimatorAnswer>;

EstimatorAnswer no_answer(const Error& error) {
    EstimatorAnswer answer;
    answer.note = error.message;
    return answer;
}

/// An estimate and its standard deviation as a central 90 % interval.
EstimatorAnswer normal_answer(double steady_state_C, double sd_C, double equilibrium_time_min) {
    constexpr double sds_of_90_percent = 1.645;
    return {steady_state_C,
            steady_state_C - sds_of_90_percent * sd_C,
            steady_state_C + sds_of_90_percent * sd_C,
            equilibrium_time_min,
            {},
            {}};
}

Answers for_each_channel(const EstimatorInput& input,
                         const std::function<EstimatorAnswer(const Column&)>& answer) {
    Answers answers;
    for (const std::string& channel : input.channels)
        answers.push_back(answer(*input.window.channel(channel)));
    return answers;
}

Answers svr(const EstimatorInput& input) {
    return for_each_channel(input, [&](const Column& column) {
        const auto swept = sweep_channel(column.values, input.window.start_s, input.window.period_s,
                                         input.options, input.parallel_for, never_cancelled);
        if (!swept) return no_answer(swept.error());
        EstimatorAnswer answer;
        answer.steady_state_C = swept->svr.steady_state_C;
        answer.equilibrium_time_min = swept->svr.equilibrium_time_min;
        answer.guards = {swept->minimum.guard};
        if (std::isnan(answer.steady_state_C)) answer.note = "its free run does not settle";
        return answer;
    });
}

/// Isolated outliers as missing samples, for what has no filter of its own.
TestWindow without_outliers(TestWindow window, const OutlierOptions& options) {
    for (Column& column : window.channels) {
        auto marked = mark_outliers(column.values, options);
        if (marked) column.values = std::move(marked->values_C);
    }
    return window;
}

Answers exponentials(const EstimatorInput& input, std::size_t count) {
    const TestWindow window = without_outliers(input.window, input.options.outliers);
    return for_each_channel(input, [&](const Column& column) {
        const auto fit = fit_exponentials(window, column.name, count);
        if (!fit) return no_answer(fit.error());
        return normal_answer(fit->steady_state_C, fit->steady_state_sd_C,
                             fit->equilibrium_time_min + input.window.start_s / 60.0);
    });
}

Answers one_exponential(const EstimatorInput& input) {
    return exponentials(input, 1);
}

Answers two_exponentials(const EstimatorInput& input) {
    return exponentials(input, 2);
}

Answers kalman(const EstimatorInput& input) {
    return for_each_channel(input, [&](const Column& column) {
        const KalmanPrediction says = kalman_prediction(column.values, input.window);
        EstimatorAnswer answer;
        answer.steady_state_C = says.steady_state_C;
        answer.steady_state_low_C = says.steady_state_low_C;
        answer.steady_state_high_C = says.steady_state_high_C;
        answer.equilibrium_time_min = says.equilibrium_time_min;
        if (std::isnan(answer.steady_state_C)) answer.note = "no good sample";
        return answer;
    });
}

Answers of_spectrum(const EstimatorInput& input, const Result<ArchivedEstimate>& estimated) {
    return for_each_channel(input, [&](const Column& column) {
        if (!estimated) return no_answer(estimated.error());
        const auto& channels = estimated->estimate.channels;
        const auto found = std::ranges::find(channels, column.name, &ChannelEstimate::channel);
        if (found == channels.end()) return no_answer({NextStep::refuse_input, "no good sample"});
        return EstimatorAnswer{found->steady_state_C,
                               found->steady_state_low_C,
                               found->steady_state_high_C,
                               found->equilibrium_time_min,
                               {},
                               estimated->contradiction.reason};
    });
}

Answers modes(const EstimatorInput& input) {
    auto estimate = estimate_spectrum(input.window, input.options.ambient, std::nullopt,
                                      input.options.spectrum, input.options.seed, input.start_level_C);
    if (!estimate) return of_spectrum(input, std::unexpected(estimate.error()));
    return of_spectrum(input, ArchivedEstimate{std::move(*estimate), {}});
}

Answers modes_with_archive(const EstimatorInput& input) {
    return of_spectrum(
        input, estimate_with_archive(input.window, input.options.ambient, *input.options.prior,
                                     input.options.spectrum, input.options.seed, input.start_level_C));
}

/// What the curve leaves of a channel, as means over `scans` scans; NaN where there is no good sample.
std::vector<double> residual_means_C(const Column& column, const std::vector<double>& curve_C,
                                     std::size_t scans) {
    std::vector<double> means_C;
    for (std::size_t first = 0; first + scans <= column.values.size(); first += scans) {
        double sum_C = 0.0;
        std::size_t good = 0;
        for (std::size_t k = first; k < first + scans; ++k) {
            if (!std::isfinite(column.values[k])) continue;
            sum_C += column.values[k] - curve_C[k];
            ++good;
        }
        means_C.push_back(good > 0 ? sum_C / static_cast<double>(good) : no_value);
    }
    return means_C;
}

/// The shared modes say where physics goes; an SVR on minute means of what they leave over says where that
/// goes: to some small value where it has found a pattern, nowhere (no correction) where its free run does
/// not settle.
Answers modes_and_svr(const EstimatorInput& input) {
    constexpr double block_s = 60.0;
    constexpr std::size_t most_lags = 10;
    const auto estimate = estimate_spectrum(input.window, input.options.ambient, std::nullopt,
                                            input.options.spectrum, input.options.seed, input.start_level_C);
    if (!estimate) return of_spectrum(input, std::unexpected(estimate.error()));
    FlowOptions options = input.options;
    options.sweep.last_lag = most_lags;
    const TestWindow window = without_outliers(input.window, options.outliers);
    const auto scans = static_cast<std::size_t>(std::max(1.0, std::round(block_s / window.period_s)));
    std::vector<double> time_s(window.scans);
    for (std::size_t k = 0; k < window.scans; ++k)
        time_s[k] = window.start_s + static_cast<double>(k) * window.period_s;
    Answers answers = of_spectrum(input, ArchivedEstimate{*estimate, {}});
    for (std::size_t i = 0; i < answers.size(); ++i) {
        const auto found =
            std::ranges::find(estimate->channels, input.channels[i], &ChannelEstimate::channel);
        if (found == estimate->channels.end()) continue;
        const auto curve_C = predict_curve(*estimate, *found, input.window, input.options.ambient, time_s);
        const auto left_C = residual_means_C(*window.channel(input.channels[i]), curve_C, scans);
        const auto swept = sweep_channel(left_C, window.start_s, static_cast<double>(scans) * window.period_s,
                                         options, input.parallel_for, never_cancelled);
        if (!swept || std::isnan(swept->svr.steady_state_C)) {
            answers[i].note = "no pattern in what the shared modes leave over";
            continue;
        }
        answers[i].steady_state_C += swept->svr.steady_state_C;
        answers[i].steady_state_low_C += swept->svr.steady_state_C;
        answers[i].steady_state_high_C += swept->svr.steady_state_C;
    }
    return answers;
}

constexpr std::array estimators{
    Estimator{"svr", "support-vector regression of the paper, literal", false, svr},
    Estimator{"one_exponential", "least squares, one exponential a channel", false, one_exponential},
    Estimator{"two_exponentials", "least squares, two exponentials a channel", false, two_exponentials},
    Estimator{"kalman", "adaptive unscented Kalman filter, a fast and a slow exponential a channel", false,
              kalman},
    Estimator{"modes", "time constants shared by all channels", false, modes},
    Estimator{"modes_and_svr", "the same, and an SVR on what they leave over", false, modes_and_svr},
    Estimator{"modes_with_archive", "shared time constants, with earlier tests of the machine", true,
              modes_with_archive},
};

}  // namespace

std::span<const Estimator> all_estimators() {
    return estimators;
}

ComparedWindow compare_estimators(const TestWindow& window, std::span<const Estimator> asked,
                                  const std::vector<std::string>& channels, const FlowOptions& options,
                                  const ParallelFor& parallel_for) {
    const Regime regime = current_regime(window, options);
    ComparedWindow compared{window.end_s() / 60.0, regime.since_s / 60.0, {}};
    const EstimatorInput input{regime.window, regime.start_level_C, channels, options, parallel_for};
    for (const Estimator& estimator : asked) compared.answers.push_back(estimator.answer(input));
    return compared;
}

RecordingEnd end_of_recording(const TestWindow& recording, const std::vector<std::string>& channels,
                              const FlowOptions& options, const MeasuredEndOptions& end_options) {
    constexpr std::size_t most_modes = 4;
    const Regime regime = current_regime(recording, options);
    const TestWindow window = without_outliers(regime.window, options.outliers);
    RecordingEnd end{
        regime.since_s / 60.0, {}, fit_shared_modes_of_best_order(window, options.ambient, most_modes)};
    for (const std::string& channel : channels)
        end.channels.push_back(measured_end(window, channel, options.ambient, end_options));
    return end;
}

namespace {

/// A figure that belongs to the channels of the modes, in the order of `channels`.
std::vector<double> in_order_of(const std::vector<std::string>& channels, const SharedModes& modes,
                                const std::vector<double>& figures) {
    std::vector<double> ordered;
    for (const std::string& channel : channels) {
        const auto found = std::ranges::find(modes.channels, channel, &SharedModes::Channel::channel);
        ordered.push_back(found == modes.channels.end()
                              ? no_value
                              : figures[static_cast<std::size_t>(found - modes.channels.begin())]);
    }
    return ordered;
}

}  // namespace

std::vector<double> least_half_width_C(const RecordingEnd& end, const std::vector<std::string>& channels,
                                       double period_s, double window_end_min, SharedKnowledge knowledge) {
    constexpr double sds_of_90_percent = 1.645;
    if (!end.modes) return std::vector<double>(channels.size(), no_value);
    auto bound_C =
        steady_state_bound_C(*end.modes, period_s, window_end_min - end.regime_since_min, knowledge);
    for (double& value : bound_C) value *= sds_of_90_percent;
    return in_order_of(channels, *end.modes, bound_C);
}

std::vector<double> earliest_knowable_min(const RecordingEnd& end, const std::vector<std::string>& channels,
                                          double period_s, double tolerance_C, double latest_min) {
    if (!end.modes) return std::vector<double>(channels.size(), no_value);
    auto earliest_min = earliest_possible_min(*end.modes, period_s, tolerance_C,
                                              latest_min - end.regime_since_min, SharedKnowledge::joint);
    for (double& value : earliest_min) value += end.regime_since_min;
    return in_order_of(channels, *end.modes, earliest_min);
}

}  // namespace thermbal
