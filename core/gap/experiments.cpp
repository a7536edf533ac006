#include "experiments.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>
#include <set>

#include "ground.hpp"
#include "network/simulate.hpp"
#include "residual_timing.hpp"

namespace thermbal {
namespace {

constexpr double second_speed = 0.6;  ///< of the first
constexpr double room_step_C = -5.0;
constexpr double separating_sigmas = 5.0;
const std::string room_column = "room of the experiment";

/// How drive and room go on after the first half of an experiment.
struct Plan {
    SeparatingExperiment::Kind kind;
    double drive_share = 1.0;
    double room_change_C = 0.0;
};
constexpr Plan unchanged{SeparatingExperiment::Kind::cool_down, 1.0, 0.0};

/// A cool-down and another speed need something that follows the spindle.
std::vector<Plan> plans_for(const std::set<std::string>& drives) {
    std::vector<Plan> plans = {{SeparatingExperiment::Kind::room_step, 1.0, room_step_C}};
    if (drives.empty()) return plans;
    plans.push_back({SeparatingExperiment::Kind::cool_down, 0.0, 0.0});
    plans.push_back({SeparatingExperiment::Kind::second_speed, second_speed, 0.0});
    return plans;
}

std::set<std::string> drives_of(const Model& model) {
    std::set<std::string> columns;
    for (const Source& source : model.sources) {
        if (!source.proportional_to.empty()) columns.insert(source.proportional_to);
    }
    return columns;
}

double mean_where(const std::vector<double>& values, const std::function<bool(double)>& counts) {
    double sum = 0.0;
    int count = 0;
    for (const double value : values) {
        if (!std::isfinite(value) || !counts(value)) continue;
        sum += value;
        ++count;
    }
    return count == 0 ? 0.0 : sum / count;
}

/// The run's inputs with every drive at its usual value and the room at its mean; the second half as planned.
Inputs inputs_for(const Plan& plan, const Model& model, const Inputs& run) {
    Inputs inputs = run;
    const double half_s = 0.5 * (run.time_s.front() + run.time_s.back());
    const auto in_two_halves = [&](double first, double second) {
        std::vector<double> values(run.time_s.size());
        std::ranges::transform(run.time_s, values.begin(),
                               [&](double time_s) { return time_s < half_s ? first : second; });
        return values;
    };
    const std::set<std::string> drives = drives_of(model);
    double room_C = model.ambient.value_C;
    for (Column& column : inputs.columns) {
        if (column.name == model.ambient.column)
            room_C = mean_where(column.values, [](double) { return true; });
        if (!drives.contains(column.name)) continue;
        const double usual = mean_where(column.values, [](double value) { return value != 0.0; });
        column.values = in_two_halves(usual, plan.drive_share * usual);
    }
    inputs.columns.push_back({room_column, in_two_halves(room_C, room_C + plan.room_change_C)});
    return inputs;
}

/// Of the run's channels, at its bins.
std::optional<Eigen::MatrixXd> readings_in(const FitData& run, Model model, const Inputs& inputs) {
    model.ambient = {room_column, model.ambient.value_C, 0.0};
    const auto simulation = simulate(model, inputs, run.seen.time_s);
    if (!simulation) return std::nullopt;
    return simulation->reading_C(Eigen::all, run.seen.sensors);
}

std::optional<Eigen::MatrixXd> difference_C(const Plan& plan, const FitData& run, const Model& one,
                                            const Model& other) {
    const Inputs inputs = inputs_for(plan, one, run.seen.inputs);
    auto one_C = readings_in(run, one, inputs);
    const auto other_C = readings_in(run, other, inputs);
    if (!one_C || !other_C) return std::nullopt;
    return *one_C - *other_C;
}

SeparatingExperiment outcome(const Plan& plan, const FitData& run, const Rival& rival,
                             const Eigen::MatrixXd& apart_C, const Eigen::MatrixXd& apart_anyway_C) {
    Eigen::Index row = 0, column = 0;
    const double largest_C = (apart_C - apart_anyway_C).cwiseAbs().maxCoeff(&row, &column);
    const double more = run.whitening(apart_C).squaredNorm() - run.whitening(apart_anyway_C).squaredNorm();
    const double sigmas = std::sqrt(std::max(more, 0.0));
    return {.against = rival.kind,
            .against_at = rival.at,
            .kind = plan.kind,
            .channel = run.seen.channels[static_cast<std::size_t>(column)],
            .difference_C = largest_C,
            .sigmas = sigmas,
            .separates = sigmas > separating_sigmas};
}

/// The linearised fit says from which numbers a full one may begin; of a kind with several forms the better.
std::optional<Effect> best_start(const Evidence& evidence, const Explanation& others,
                                 const Suspect& suspect) {
    const ScreeningGround ground(evidence, others);
    const ResidualTiming timing = residual_timing(evidence.run, others.fit.point);
    std::optional<Screened> best;
    for (const Candidate& candidate : all_candidates(others.fit.model, evidence.room_columns)) {
        if (candidate.definition->kind != suspect.kind || candidate.at != suspect.at) continue;
        Screened one = screen(candidate, ground, timing);
        if (!best || one.log_likelihood_gain > best->log_likelihood_gain) best = std::move(one);
    }
    if (!best) return std::nullopt;
    return best->start;
}

}  // namespace

std::string_view to_string(SeparatingExperiment::Kind kind) {
    switch (kind) {
        case SeparatingExperiment::Kind::cool_down:
            return "cool_down";
        case SeparatingExperiment::Kind::second_speed:
            return "second_speed";
        case SeparatingExperiment::Kind::room_step:
            break;
    }
    return "room_step";
}

std::string_view in_words(SeparatingExperiment::Kind kind) {
    switch (kind) {
        case SeparatingExperiment::Kind::cool_down:
            return "a run at constant speed whose spindle is stopped half way, measured on while it cools "
                   "down";
        case SeparatingExperiment::Kind::second_speed:
            return "a run at constant speed that goes on at 60 % of it from half way on";
        case SeparatingExperiment::Kind::room_step:
            break;
    }
    return "a run at constant speed with the room 5 \u00b0C colder from half way on";
}

std::vector<Rival> fitted_rivals(const Evidence& evidence, const Explanation& others,
                                 const std::vector<Suspect>& suspects, double least, std::size_t most) {
    std::vector<Rival> rivals;
    for (const Suspect& suspect : suspects) {
        if (suspect.kind.empty() || suspect.probability < least || rivals.size() == most) continue;
        const auto start = best_start(evidence, others, suspect);
        if (!start) continue;
        std::vector<Effect> effects = others.effects;
        effects.push_back(*start);
        auto fitted = explain(evidence, std::move(effects), &others);
        if (fitted) rivals.push_back({suspect.kind, suspect.at, std::move(fitted->fit.model)});
    }
    return rivals;
}

std::vector<SeparatingExperiment> separating_experiments(const FitData& run, const Model& named,
                                                         const std::vector<Rival>& rivals) {
    std::vector<SeparatingExperiment> all;
    for (const Rival& rival : rivals) {
        const auto anyway_C = difference_C(unchanged, run, named, rival.model);
        if (!anyway_C) continue;
        std::vector<SeparatingExperiment> of_rival;
        for (const Plan& plan : plans_for(drives_of(named))) {
            const auto apart_C = difference_C(plan, run, named, rival.model);
            if (apart_C) of_rival.push_back(outcome(plan, run, rival, *apart_C, *anyway_C));
        }
        std::ranges::stable_sort(of_rival, std::ranges::greater{}, &SeparatingExperiment::sigmas);
        std::ranges::move(of_rival, std::back_inserter(all));
    }
    return all;
}

}  // namespace thermbal
