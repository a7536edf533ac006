#include "compare.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "comparison_plot.hpp"
#include "comparison_text.hpp"
#include "compute/threads.hpp"
#include "declaration/compare.hpp"
#include "files.hpp"
#include "offline_input.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "report/verdict_json.hpp"
#include "series/sample.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

/// The estimators that are asked for, in the table's order.
Result<std::vector<Estimator>> chosen_estimators(const CompareOptions& options, bool has_prior) {
    std::string known;
    for (const Estimator& estimator : all_estimators())
        known += (known.empty() ? "" : ", ") + std::string(estimator.name);
    for (const std::string& name : options.estimators) {
        const auto found = std::ranges::find(all_estimators(), name, &Estimator::name);
        if (found == all_estimators().end())
            return fail(NextStep::refuse_input, fmt::format("no estimator {}; there are {}", name, known));
        if (found->needs_prior && !has_prior)
            return fail(NextStep::refuse_input,
                        fmt::format("{} needs earlier tests; name their database with --archive", name));
    }
    std::vector<Estimator> chosen;
    for (const Estimator& estimator : all_estimators()) {
        const bool named = std::ranges::find(options.estimators, estimator.name) != options.estimators.end();
        if (named || (options.estimators.empty() && (has_prior || !estimator.needs_prior)))
            chosen.push_back(estimator);
    }
    return chosen;
}

std::vector<std::string> wanted_channels(const OfflineOptions& options, const OfflineInput& input) {
    std::vector<std::string> channels;
    for (const Column& column : input.window.channels) {
        if (column.name != input.flow.ambient && is_wanted(options, column.name))
            channels.push_back(column.name);
    }
    return channels;
}

json answer_json(const EstimatorAnswer& answer, double settles_at_C) {
    const double error_C = answer.steady_state_C - settles_at_C;
    const bool can_hold = std::isfinite(answer.steady_state_low_C) &&
                          std::isfinite(answer.steady_state_high_C) && std::isfinite(settles_at_C);
    json guards = json::array();
    for (const Guard& guard : answer.guards) guards.push_back(guard_to_json(guard));
    json result = {{"steady_state_C", number_or_null(answer.steady_state_C)},
                   {"steady_state_low_C", number_or_null(answer.steady_state_low_C)},
                   {"steady_state_high_C", number_or_null(answer.steady_state_high_C)},
                   {"equilibrium_time_min", number_or_null(answer.equilibrium_time_min)},
                   {"error_C", number_or_null(error_C)},
                   {"held", nullptr},
                   {"guards", std::move(guards)},
                   {"note", answer.note}};
    if (can_hold)
        result["held"] =
            answer.steady_state_low_C <= settles_at_C && settles_at_C <= answer.steady_state_high_C;
    return result;
}

json end_json(const Result<MeasuredEnd>& end) {
    if (!end) return {{"settled", false}, {"mean_C", nullptr}, {"figures", end.error().message}};
    return {{"settled", end->settled},
            {"mean_C", number_or_null(end->mean_C)},
            {"start_C", number_or_null(end->start_C)},
            {"room_C", number_or_null(end->room_C)},
            {"time_constant_min", number_or_null(end->time_constant_min)},
            {"moved_C", number_or_null(end->moved_C)},
            {"still_to_come_C", number_or_null(end->still_to_come_C)},
            {"figures", end->figures}};
}

/// One recording, what it says in the end, and the windows as they are compared.
class Comparison {
  public:
    Comparison(const CompareOptions& options, OfflineInput input, std::vector<Estimator> estimators)
        : options_(options),
          input_(std::move(input)),
          estimators_(std::move(estimators)),
          channels_(wanted_channels(options.recording, input_)),
          end_(end_of_recording(input_.window, channels_, input_.flow)) {}

    json run(Progress& progress) {
        json document = head();
        const ParallelFor parallel_for = parallel_on_threads(options_.recording.threads, false);
        const double end_min = input_.window.end_s() / 60.0;
        const double step_min = options_.recording.every_min;
        const double first_min = input_.window.start_s / 60.0;
        for (int k = 1; first_min + k * step_min <= end_min + 1e-9; ++k) {
            const TestWindow window = window_until(input_.window, (first_min + k * step_min) * 60.0);
            add(document["channels"],
                compare_estimators(window, estimators_, channels_, input_.flow, parallel_for));
            // The work of a window grows with its length, so all windows up to here go with its square.
            progress.set(std::pow(k * step_min / (end_min - first_min), 2.0));
        }
        document["summary"] = comparison_summary(document);
        return document;
    }

  private:
    json head() const {
        json estimators = json::array();
        for (const Estimator& estimator : estimators_)
            estimators.push_back({{"name", estimator.name}, {"what", estimator.what}});
        const auto earliest_min =
            earliest_knowable_min(end_, channels_, input_.window.period_s, options_.recording.tolerance_C,
                                  input_.window.end_s() / 60.0);
        json channels = json::array();
        for (std::size_t i = 0; i < channels_.size(); ++i) {
            channels.push_back({{"channel", channels_[i]},
                                {"end", end_json(end_.channels[i])},
                                {"earliest_knowable_min", number_or_null(earliest_min[i])},
                                {"windows", json::array()}});
        }
        return {{"recording", options_.recording.file},
                {"end_min", input_.window.end_s() / 60.0},
                {"regime_since_min", end_.regime_since_min},
                {"tolerance_C", options_.recording.tolerance_C},
                {"time_constants_min", end_.modes ? json(end_.modes->time_constant_min) : json(nullptr)},
                {"estimators", std::move(estimators)},
                {"channels", std::move(channels)}};
    }

    /// Where a channel settles while the room stays as it is at a window's end; NaN before the last regime.
    double settles_at_C(std::size_t channel, double window_end_min) const {
        const auto& end = end_.channels[channel];
        if (!end || window_end_min <= end_.regime_since_min) return no_value;
        const double room_C = mean_before_C(input_.window, input_.flow.ambient, window_end_min * 60.0,
                                            MeasuredEndOptions{}.mean_min);
        return end->settles_at_C(room_C);
    }

    void add(json& channels, const ComparedWindow& window) const {
        const double period_s = input_.window.period_s;
        const auto joint_C =
            least_half_width_C(end_, channels_, period_s, window.window_end_min, SharedKnowledge::joint);
        const auto alone_C = least_half_width_C(end_, channels_, period_s, window.window_end_min,
                                                SharedKnowledge::single_channel);
        for (std::size_t i = 0; i < channels_.size(); ++i) {
            const double settles_C = settles_at_C(i, window.window_end_min);
            json answers = json::object();
            for (std::size_t e = 0; e < estimators_.size(); ++e)
                answers[std::string(estimators_[e].name)] = answer_json(window.answers[e][i], settles_C);
            channels[i]["windows"].push_back({{"window_end_min", window.window_end_min},
                                              {"regime_since_min", window.regime_since_min},
                                              {"settles_at_C", number_or_null(settles_C)},
                                              {"least_half_width_C", number_or_null(joint_C[i])},
                                              {"least_half_width_alone_C", number_or_null(alone_C[i])},
                                              {"estimators", std::move(answers)}});
        }
    }

    const CompareOptions& options_;
    OfflineInput input_;
    std::vector<Estimator> estimators_;
    std::vector<std::string> channels_;
    RecordingEnd end_;
};

Result<void> draw(const json& document, const std::string& path) {
    const bool is_page = path.ends_with(".html");
    return write_file(path, is_page ? comparison_page(document) : comparison_svg(document));
}

}  // namespace

int run_compare(const CompareOptions& options) {
    if (!options.plot.empty() && !options.plot.ends_with(".html") && !options.plot.ends_with(".svg")) {
        return report_error(
            {NextStep::refuse_input,
             fmt::format("--plot {}: expected a name that ends in .html or .svg", options.plot)});
    }
    auto input = read_input(options.recording);
    if (!input) return report_error(input.error());
    if (const double length_min = (input->window.end_s() - input->window.start_s) / 60.0;
        options.recording.every_min > length_min) {
        return report_error({NextStep::refuse_input,
                             fmt::format("--every-min {}: there are {:.1f} min of the recording, which is no "
                                         "window; give less",
                                         options.recording.every_min, length_min)});
    }
    auto estimators = chosen_estimators(options, input->flow.prior.has_value());
    if (!estimators) return report_error(estimators.error());
    std::optional<Progress> progress("compare");
    const json document = Comparison(options, std::move(*input), std::move(*estimators)).run(*progress);
    progress.reset();
    if (!options.plot.empty()) {
        if (const auto drawn = draw(document, options.plot); !drawn) return report_error(drawn.error());
    }
    if (options.recording.json) return print_json(document);
    return print_text(comparison_text(document, !options.recording.channels.empty()));
}

}  // namespace thermbal
