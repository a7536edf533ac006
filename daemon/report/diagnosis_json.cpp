#include "report/diagnosis_json.hpp"

#include <cmath>

#include "report/verdict_json.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

/// The central 90 % interval of a fitted number; symmetric in the coordinate that was fitted.
std::pair<double, double> interval_of(const CalibratedParameter& number) {
    constexpr double z90 = 1.645;
    const double at = number.parameter.to_coordinate(number.value);
    return {number.parameter.to_value(at - z90 * number.sigma),
            number.parameter.to_value(at + z90 * number.sigma)};
}

json suspects_to_json(const std::vector<Suspect>& suspects) {
    json list = json::array();
    for (const Suspect& suspect : suspects) {
        list.push_back({{"kind", suspect.kind.empty() ? "unknown" : suspect.kind},
                        {"at", suspect.at},
                        {"probability", suspect.probability}});
    }
    return list;
}

json effect_to_json(const FoundEffect& found) {
    json parameters = json::object(), intervals = json::object();
    for (const CalibratedParameter& number : found.parameters) {
        const std::string name = number.parameter.short_name();
        const auto [low, high] = interval_of(number);
        parameters[name] = number_or_null(number.value);
        intervals[name] = {number_or_null(low), number_or_null(high)};
    }
    if (found.cycle_s) parameters["period_s"] = number_or_null(*found.cycle_s);
    json experiments = json::array();
    for (const SeparatingExperiment& one : found.experiments) {
        experiments.push_back({{"against", one.against},
                               {"against_at", one.against_at},
                               {"kind", to_string(one.kind)},
                               {"experiment", in_words(one.kind)},
                               {"separates", one.separates},
                               {"channel", one.channel},
                               {"difference_C", number_or_null(one.difference_C)},
                               {"sigmas", number_or_null(one.sigmas)}});
    }
    return {{"kind", found.effect.kind},
            {"at", found.at},
            {"channels", found.channels},
            {"from_s", number_or_null(found.from_s)},
            {"to_s", number_or_null(found.to_s)},
            {"probability", number_or_null(found.probability)},
            {"parameters", std::move(parameters)},
            {"parameters_90_percent", std::move(intervals)},
            {"alternatives", suspects_to_json(found.alternatives)},
            {"separating_experiments", std::move(experiments)},
            {"rmse_before_C", number_or_null(found.rmse_before_C)},
            {"rmse_after_C", number_or_null(found.rmse_after_C)}};
}

json run_to_json(const RunComparison& run) {
    json channels = json::array();
    for (std::size_t c = 0; c < run.channels.size(); ++c) {
        const auto k = static_cast<Eigen::Index>(c);
        channels.push_back({{"channel", run.channels[c]},
                            {"before_rmse_C", number_or_null(run.channel_before_rmse_C(k))},
                            {"after_rmse_C", number_or_null(run.channel_after_rmse_C(k))}});
    }
    return {{"name", run.name},
            {"before_rmse_C", number_or_null(run.before_rmse_C)},
            {"after_rmse_C", number_or_null(run.after_rmse_C)},
            {"channels", std::move(channels)}};
}

json gap_to_json(const Diagnosis& diagnosis) {
    json holdouts = json::array();
    double before = 0.0, after = 0.0;
    for (const RunComparison& run : diagnosis.holdouts) {
        holdouts.push_back(run_to_json(run));
        before += run.before_rmse_C * run.before_rmse_C;
        after += run.after_rmse_C * run.after_rmse_C;
    }
    const auto count = static_cast<double>(diagnosis.holdouts.size());
    return {{"before_rmse_C", number_or_null(diagnosis.run.before_rmse_C)},
            {"after_rmse_C", number_or_null(diagnosis.run.after_rmse_C)},
            {"holdout_before_rmse_C", number_or_null(std::sqrt(before / count))},
            {"holdout_after_rmse_C", number_or_null(std::sqrt(after / count))},
            {"run", run_to_json(diagnosis.run)},
            {"holdouts", std::move(holdouts)}};
}

json residual_heat_to_json(const ResidualHeat& heat) {
    return {{"at", heat.at},           {"of", heat.of_sensor ? "sensor" : "node"},
            {"from_s", heat.from_s},   {"to_s", heat.to_s},
            {"follows", heat.follows}, {"log_bayes_factor", number_or_null(heat.log_bayes_factor)},
            {"time_s", heat.time_s},   {heat.of_sensor ? "error_C" : "power_W", heat.course},
            {"sigma", heat.sigma}};
}

}  // namespace

json diagnosis_to_json(const Diagnosis& diagnosis) {
    json disagreements = json::array(), effects = json::array(), heat = json::array();
    for (const Disagreement& one : diagnosis.disagreements) {
        disagreements.push_back({{"channel", one.channel},
                                 {"from_s", one.from_s},
                                 {"to_s", one.to_s},
                                 {"rms_C", number_or_null(one.rms_C)},
                                 {"peak_C", number_or_null(one.peak_C)},
                                 {"sigmas", number_or_null(one.sigmas)}});
    }
    for (const FoundEffect& found : diagnosis.effects) effects.push_back(effect_to_json(found));
    for (const ResidualHeat& one : diagnosis.residual_heat) heat.push_back(residual_heat_to_json(one));
    return {{"gap", gap_to_json(diagnosis)},   {"verdict", to_string(diagnosis.verdict)},
            {"reason", diagnosis.reason},      {"disagreements", std::move(disagreements)},
            {"effects", std::move(effects)},   {"suspects", suspects_to_json(diagnosis.suspects)},
            {"residual_heat", std::move(heat)}};
}

}  // namespace thermbal
