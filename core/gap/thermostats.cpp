#include "thermostats.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <Eigen/QR>

#include "heat_response.hpp"
#include "network/simulate.hpp"
#include "pooling.hpp"

namespace thermbal {
namespace {

using Eigen::Index;

constexpr double nats_that_speak_for_heat = 5.0;
constexpr std::size_t most_nodes = 3;
/// A chiller that is strong enough never lets its node get warmer than where it switches on.
constexpr std::array below_the_warmest = {0.0, 0.004, 0.01, 0.02, 0.04, 0.08, 0.15};  ///< shares of the range
constexpr std::array hysteresis_shares = {0.005, 0.012, 0.03, 0.07, 0.16, 0.35};      ///< of the range
constexpr std::size_t on_off_on = 3;  ///< what switches on and stays on is another effect: heat that sets in

Index column_of(const Simulation& simulation, const std::string& node) {
    return std::ranges::find(simulation.node_names, node) - simulation.node_names.begin();
}

/// Empty when the model cannot be simulated.
Eigen::VectorXd node_course(const Model& model, const Observation& seen, const std::string& node) {
    const auto simulation = simulate(model, seen.inputs, seen.time_s);
    if (!simulation) return {};
    return simulation->node_C.col(column_of(*simulation, node));
}

/// What the node's thermostat felt: the mean of the readings on the node, smoothed over three bins; what the
/// model says where nothing is measured.
Eigen::VectorXd felt_C(const Evidence& evidence, const Explanation& current, const std::string& node) {
    const Observation& seen = evidence.run.seen;
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(seen.reading_C.rows());
    int sensors = 0;
    for (std::size_t c = 0; c < seen.columns(); ++c) {
        if (current.fit.model.sensors[seen.sensors[c]].node != node) continue;
        const auto column = static_cast<Index>(c);
        sum += seen.reading_C.col(column).array().isFinite().select(
            seen.reading_C.col(column), current.fit.point.simulated_C.col(column));
        ++sensors;
    }
    if (sensors == 0) return node_course(current.fit.model, seen, node);
    Eigen::VectorXd smoothed = sum / sensors;
    for (Index row = 1; row + 1 < sum.size(); ++row) smoothed(row) = sum.segment(row - 1, 3).mean() / sensors;
    return smoothed;
}

/// When a thermostat with these thresholds would have switched, on first.
std::vector<double> moments_of(const Eigen::VectorXd& felt_C, const std::vector<double>& time_s, double on_C,
                               double hysteresis_C) {
    std::vector<double> moments_s;
    for (Index row = 0; row < felt_C.size(); ++row) {
        const bool runs = moments_s.size() % 2 == 1;
        if (runs ? felt_C(row) < on_C - hysteresis_C : felt_C(row) > on_C)
            moments_s.push_back(time_s[static_cast<std::size_t>(row)]);
    }
    return moments_s;
}

/// Of a course that is smooth without it.
double noise_of(const Eigen::VectorXd& felt_C) {
    const double seen_C = noise_from_differences_C({felt_C.begin(), felt_C.end()});
    return std::isfinite(seen_C) ? std::max(seen_C, 1e-3) : 1e-3;
}

/// When the node turned: from warming to cooling, that is where its chiller was switched on, and back, each
/// turn by `least_C` or more. Noise moves these less than the crossing of a threshold that is approached
/// slowly.
std::vector<double> turns_of(const Eigen::VectorXd& felt_C, const std::vector<double>& time_s,
                             double least_C) {
    std::vector<double> turns_s;
    Index furthest = 0;
    for (Index row = 0; row < felt_C.size(); ++row) {
        const double sign = turns_s.size() % 2 == 0 ? 1.0 : -1.0;
        if (sign * (felt_C(row) - felt_C(furthest)) > 0.0) furthest = row;
        if (sign * (felt_C(furthest) - felt_C(row)) < least_C) continue;
        turns_s.push_back(time_s[static_cast<std::size_t>(furthest)]);
        furthest = row;
    }
    return turns_s;
}

/// To 1 W taken away from every odd moment to the next.
Eigen::MatrixXd answer_to_cooling(const CourseOfReadings& answer_to_heat, const std::vector<double>& time_s,
                                  const std::vector<double>& moments_s) {
    Eigen::MatrixXd change_C = Eigen::MatrixXd::Zero(answer_to_heat.rows(), answer_to_heat.columns());
    double sign = -1.0;
    for (const double moment_s : moments_s) {
        const auto first = std::ranges::upper_bound(time_s, moment_s) - time_s.begin();
        for (Index row = first; row < change_C.rows(); ++row)
            change_C.row(row) += sign * answer_to_heat.at(time_s[static_cast<std::size_t>(row)] - moment_s);
        sign = -sign;
    }
    return change_C;
}

/// Mean temperature of the node when it was switched on, and when off.
std::array<double, 2> thresholds_C(const Eigen::VectorXd& node_C, const std::vector<double>& time_s,
                                   const std::vector<double>& moments_s) {
    std::array<double, 2> sum_C{}, count{};
    for (std::size_t k = 0; k < moments_s.size(); ++k) {
        const auto row = std::min<Index>(std::ranges::lower_bound(time_s, moments_s[k]) - time_s.begin(),
                                         node_C.size() - 1);
        sum_C[k % 2] += node_C(row);
        count[k % 2] += 1.0;
    }
    return {sum_C[0] / count[0], sum_C[1] / count[1]};
}

/// Searches the thresholds of a thermostat at one node.
class ThermostatSearch {
  public:
    /// All outlive it.
    ThermostatSearch(const FitData& run, const Model& model, const Linearisation& linearisation,
                     const CourseOfReadings& answer_to_heat, const Candidate& candidate)
        : run_(run),
          linearisation_(linearisation),
          answer_to_heat_(answer_to_heat),
          best_{candidate, make_effect(*candidate.definition, *candidate.form, candidate.at, model), 0.0} {}

    Screened over(const Eigen::VectorXd& felt_C) {
        if (felt_C.size() == 0) return best_;
        const double warmest_C = felt_C.maxCoeff(), range_C = warmest_C - felt_C.minCoeff();
        for (const double below : below_the_warmest) {
            for (const double hysteresis : hysteresis_shares)
                look_at(felt_C, warmest_C - below * range_C, hysteresis * range_C);
        }
        for (double turn_C = 5.0 * noise_of(felt_C); turn_C < range_C; turn_C *= 1.5)
            look_at_turns(felt_C, turn_C);
        double step = 0.5;
        for (int round = 0; round < 3 && best_.log_likelihood_gain > 0.0; ++round) {
            const double on_C = best_.start.parameter("switch_on_C");
            const double hysteresis_C = best_.start.parameter("hysteresis_C");
            for (const double side : {-1.0, 1.0}) {
                look_at(felt_C, on_C + side * step * hysteresis_C, hysteresis_C);
                look_at(felt_C, on_C, hysteresis_C * std::exp(side * step));
                look_at(felt_C, on_C + side * step * hysteresis_C, hysteresis_C * std::exp(side * step));
            }
            step *= 0.5;
        }
        return best_;
    }

  private:
    void look_at(const Eigen::VectorXd& felt_C, double on_C, double hysteresis_C) {
        look_at(moments_of(felt_C, run_.seen.time_s, on_C, hysteresis_C), on_C, hysteresis_C);
    }

    void look_at_turns(const Eigen::VectorXd& felt_C, double least_C) {
        const auto turns_s = turns_of(felt_C, run_.seen.time_s, least_C);
        if (turns_s.size() < on_off_on) return;
        const auto [on_C, off_C] = thresholds_C(felt_C, run_.seen.time_s, turns_s);
        look_at(turns_s, on_C, on_C - off_C);
    }

    void look_at(const std::vector<double>& moments_s, double on_C, double hysteresis_C) {
        if (moments_s.size() < on_off_on) return;
        const Eigen::VectorXd change =
            pooled(run_.whitening(answer_to_cooling(answer_to_heat_, run_.seen.time_s, moments_s)),
                   answer_to_heat_.rows());
        const auto gain = linearisation_.gain_of(change);
        if (gain.amplitude <= 0.0 || gain.log_likelihood <= best_.log_likelihood_gain) return;
        best_.log_likelihood_gain = gain.log_likelihood;
        const std::array values = {gain.amplitude, on_C, hysteresis_C};
        for (std::size_t p = 0; p < values.size(); ++p) best_.start.parameters[p].value = values[p];
        best_.moments_s = moments_s;
    }

    const FitData& run_;
    const Linearisation& linearisation_;
    const CourseOfReadings& answer_to_heat_;
    Screened best_;
};

bool is_cooled_already(const Model& model, const std::string& node) {
    return std::ranges::any_of(model.effects, [&](const Effect& effect) {
        return effect.kind == "coolant_cycling" && effect.at == node;
    });
}

std::vector<std::string> nodes_that_speak_for_heat(const std::vector<Nameless>& nameless,
                                                   const Model& model) {
    std::vector<std::string> nodes;
    for (const Nameless& one : nameless) {
        if (one.log_bayes_factor < nats_that_speak_for_heat || nodes.size() == most_nodes) break;
        if (!one.of_sensor && !is_cooled_already(model, one.at)) nodes.push_back(one.at);
    }
    return nodes;
}

/// Of the node that an effect is at.
std::vector<ThermostatSwitching> switchings_of(const Effect& effect, const Model& model,
                                               const Observation& seen) {
    const auto simulation = simulate(model, seen.inputs, seen.time_s);
    if (!simulation) return {};
    const auto node = static_cast<std::size_t>(column_of(*simulation, effect.at));
    std::vector<ThermostatSwitching> switchings = simulation->switchings;
    std::erase_if(switchings, [&](const ThermostatSwitching& one) { return one.node != node; });
    return switchings;
}

using Held = std::vector<Inputs::SeenSwitchings>;

Held::const_iterator held_at(const Evidence& evidence, const std::string& node) {
    return std::ranges::find(evidence.run.seen.inputs.seen_switchings, node, &Inputs::SeenSwitchings::node);
}

bool is_held(const Evidence& evidence, const std::string& node) {
    return held_at(evidence, node) != evidence.run.seen.inputs.seen_switchings.end();
}

/// The node's chiller runs when it was seen to.
Evidence as_seen(Evidence evidence, const std::string& node, const std::vector<double>& moments_s) {
    evidence.run.seen.inputs.seen_switchings.push_back({node, moments_s});
    return evidence;
}

/// In no run of the evidence is a chiller held that this says of.
template <typename Predicate>
void let_go(Evidence& evidence, Predicate of_node) {
    const auto in = [&](FitData& data) {
        std::erase_if(data.seen.inputs.seen_switchings,
                      [&](const Inputs::SeenSwitchings& one) { return of_node(one.node); });
    };
    in(evidence.run);
    std::ranges::for_each(evidence.holdouts, in);
}

Evidence as_it_switches(Evidence evidence, const std::string& node) {
    let_go(evidence, [&](const std::string& one) { return one == node; });
    return evidence;
}

/// The thresholds of one thermostat among the coordinates of a fit, moved until it switches when it was seen
/// to.
class ThresholdFit {
  public:
    /// `effect`: among the model's. Moments: on first. All outlive it.
    ThresholdFit(const FitProblem& problem, std::size_t effect, const std::vector<double>& moments_s)
        : problem_(problem), moments_s_(moments_s) {
        const auto& parameters = problem.parameters();
        const auto power = std::ranges::find_if(parameters, [&](const Parameter& parameter) {
            return parameter.of_effect && parameter.effect == effect;
        });
        on_ = power - parameters.begin() + 1;
        const Model model = problem.model_at(problem.prior_coordinates());
        const auto node = std::ranges::find(model.nodes, model.effects[effect].at, &Node::name);
        node_ = static_cast<std::size_t>(node - model.nodes.begin());
    }

    Eigen::VectorXd placed(Eigen::VectorXd coordinates, double on_C, double hysteresis_C) const {
        const auto& parameters = problem_.parameters();
        const auto put = [&](Index at, double value) {
            coordinates(at) = parameters[static_cast<std::size_t>(at)].to_coordinate(value);
        };
        put(on_, on_C);
        put(on_ + 1, hysteresis_C);
        return coordinates;
    }

    /// Gauss-Newton on the moments, the first few, then more: a later one says little until those before it
    /// are right.
    Eigen::VectorXd aligned(Eigen::VectorXd coordinates) const {
        for (std::size_t count = 3;; count *= 2) {
            count = std::min(count, moments_s_.size());
            for (int round = 0; round < 4; ++round) {
                auto next = stepped(coordinates, count);
                if (!next) break;
                coordinates = std::move(*next);
            }
            if (count == moments_s_.size()) return coordinates;
        }
    }

  private:
    /// By how much each of the first moments is late; none where there are not that many.
    std::optional<Eigen::VectorXd> late_s(const Eigen::VectorXd& coordinates, std::size_t count) const {
        const auto simulation = simulate(problem_.model_at(coordinates), problem_.inputs_at(coordinates),
                                         problem_.data().seen.time_s);
        if (!simulation) return std::nullopt;
        std::vector<double> switched_s;
        for (const ThermostatSwitching& one : simulation->switchings) {
            if (one.node == node_) switched_s.push_back(one.time_s);
        }
        if (switched_s.size() < count) return std::nullopt;
        Eigen::VectorXd late(static_cast<Index>(count));
        for (std::size_t k = 0; k < count; ++k) late(static_cast<Index>(k)) = switched_s[k] - moments_s_[k];
        return late;
    }

    /// None where no step makes the first moments come closer.
    std::optional<Eigen::VectorXd> stepped(const Eigen::VectorXd& coordinates, std::size_t count) const {
        const auto late = late_s(coordinates, count);
        if (!late) return std::nullopt;
        const auto& hysteresis = problem_.parameters()[static_cast<std::size_t>(on_ + 1)];
        const double probe_C = 0.01 * hysteresis.to_value(coordinates(on_ + 1));
        Eigen::MatrixXd slope(late->size(), 2);
        for (const Index k : {Index{0}, Index{1}}) {
            Eigen::VectorXd moved = coordinates;
            const double probe = k == 0 ? probe_C : 0.01;  // the hysteresis is on a logarithm
            moved(on_ + k) += probe;
            const auto then = late_s(moved, count);
            if (!then) return std::nullopt;
            slope.col(k) = (*then - *late) / probe;
        }
        const Eigen::Vector2d wanted = -slope.colPivHouseholderQr().solve(*late);
        const double longest = std::max(std::abs(wanted(0)) / (30.0 * probe_C), std::abs(wanted(1)) / 0.3);
        for (double share = 1.0 / std::max(longest, 1.0); share > 0.05; share *= 0.5) {
            Eigen::VectorXd moved = coordinates;
            moved.segment(on_, 2) += share * wanted;
            const auto then = late_s(moved, count);
            if (then && then->squaredNorm() < late->squaredNorm()) return moved;
        }
        return std::nullopt;
    }

    const FitProblem& problem_;
    const std::vector<double>& moments_s_;
    Index on_ = 0;  ///< coordinate of switch_on_C; that of hysteresis_C is the next
    std::size_t node_ = 0;
};

/// A fit whose k-th effect ran when it was seen to (`schedule`: holds that), as a thermostat: it switches
/// about when it did then. Many cycles on, a hundredth of the hysteresis is half a cycle, and a fit to the
/// readings would not find back from there.
Result<Explanation> set_free(const Evidence& schedule, Explanation scheduled, std::size_t k) {
    const Observation& seen = schedule.run.seen;
    const std::string& node = scheduled.effects[k].at;
    const Evidence evidence = as_it_switches(schedule, node);
    const auto node_C = node_course(scheduled.fit.model, seen, node);
    if (node_C.size() == 0) return fail(NextStep::stop, "the chiller as seen cannot be simulated");
    const std::vector<double>& moments_s = held_at(schedule, node)->moments_s;
    const auto [on_C, off_C] = thresholds_C(node_C, seen.time_s, moments_s);
    const FitProblem free(evidence.run, with_effects(evidence.prior_model, scheduled.effects));
    const ThresholdFit thresholds(free, evidence.prior_model.effects.size() + k, moments_s);
    Eigen::VectorXd& coordinates = scheduled.fit.point.coordinates;
    coordinates = thresholds.aligned(thresholds.placed(coordinates, on_C, std::max(on_C - off_C, 0.02)));
    return polish(evidence, scheduled);
}

/// In the held-out runs it is held at what the explanation forecasts.
void hold_in_holdouts(Evidence& evidence, const Effect& effect, const Model& model) {
    for (FitData& holdout : evidence.holdouts) {
        std::vector<double> moments_s;
        for (const ThermostatSwitching& one : switchings_of(effect, model, holdout.seen))
            moments_s.push_back(one.time_s);
        if (!moments_s.empty())
            holdout.seen.inputs.seen_switchings.push_back({effect.at, std::move(moments_s)});
    }
}

}  // namespace

Result<Explanation> explain_thermostat(const Evidence& evidence, const Explanation& current,
                                       const Screened& screened) {
    const Evidence seen = as_seen(evidence, screened.candidate.at, screened.moments_s);
    std::vector<Effect> effects = current.effects;
    effects.push_back(screened.start);
    // What the numbers have done to make up for a strong chiller, a fit may not find back from.
    auto scheduled = explain_anew(seen, effects, current.fit.point.coordinates);
    auto afresh = explain(seen, effects, nullptr);
    if (!scheduled || (afresh && afresh->fit.point.chi2 < scheduled->fit.point.chi2))
        scheduled = std::move(afresh);
    if (!scheduled) return scheduled;
    return set_free(seen, std::move(*scheduled), effects.size() - 1);
}

Result<Explanation> polish_thermostats(const Evidence& evidence, const Explanation& explanation) {
    auto best = polish(evidence, explanation);
    const std::size_t known = evidence.prior_model.effects.size();
    for (std::size_t k = 0; k < explanation.effects.size(); ++k) {
        if (!form_of(explanation.effects[k]).steers_itself) continue;
        const Model& model = explanation.fit.model;
        std::vector<double> moments_s;
        for (const ThermostatSwitching& one :
             switchings_of(model.effects[known + k], model, evidence.run.seen))
            moments_s.push_back(one.time_s);
        if (moments_s.size() < on_off_on) continue;
        const Evidence seen = as_seen(evidence, explanation.effects[k].at, moments_s);
        auto scheduled = polish(seen, explanation);
        if (!scheduled) continue;
        auto freed = set_free(seen, std::move(*scheduled), k);
        if (freed && (!best || freed->fit.point.chi2 < best->fit.point.chi2)) best = std::move(freed);
    }
    return best;
}

Result<Explanation> hold_thermostats(Evidence& evidence, const Explanation& explanation) {
    const FitProblem problem(evidence.run, with_effects(evidence.prior_model, explanation.effects));
    const Eigen::VectorXd& coordinates = explanation.fit.point.coordinates;
    const auto simulation =
        simulate(explanation.fit.model, problem.inputs_at(coordinates), evidence.run.seen.time_s);
    if (!simulation) return std::unexpected(simulation.error());
    bool more = false;
    for (const Effect& effect : explanation.effects) {
        if (!form_of(effect).steers_itself || is_held(evidence, effect.at)) continue;
        const auto node = static_cast<std::size_t>(column_of(*simulation, effect.at));
        std::vector<double> moments_s;
        for (const ThermostatSwitching& one : simulation->switchings) {
            if (one.node == node) moments_s.push_back(one.time_s);
        }
        if (moments_s.size() < on_off_on) continue;
        evidence = as_seen(std::move(evidence), effect.at, moments_s);
        hold_in_holdouts(evidence, effect, explanation.fit.model);
        more = true;
    }
    return more ? polish(evidence, explanation) : explanation;
}

void let_go_of_others(Evidence& evidence, const std::vector<Effect>& effects) {
    let_go(evidence, [&](const std::string& node) {
        return std::ranges::none_of(effects, [&](const Effect& effect) {
            return form_of(effect).steers_itself && effect.at == node;
        });
    });
}

Result<Explanation> release_thermostats(const Evidence& held, Explanation explanation) {
    Evidence still_held = held;
    for (std::size_t k = 0; k < explanation.effects.size(); ++k) {
        const std::string node = explanation.effects[k].at;
        if (!form_of(explanation.effects[k]).steers_itself || !is_held(still_held, node)) continue;
        auto freed = set_free(still_held, std::move(explanation), k);
        if (!freed) return freed;
        explanation = std::move(*freed);
        still_held = as_it_switches(std::move(still_held), node);
    }
    return explanation;
}

std::vector<Screened> screen_thermostats(const Evidence& evidence, const Explanation& current,
                                         const std::vector<Nameless>& nameless) {
    const std::vector<std::string> nodes = nodes_that_speak_for_heat(nameless, current.fit.model);
    if (nodes.empty()) return {};
    const EffectDefinition& chiller = *find_effect("coolant_cycling");
    const FitProblem problem(evidence.run, current.fit.model);
    const Fit fewer = with_pooled_readings(current.fit);
    const Linearisation linearisation(fewer);
    std::vector<Screened> screened(nodes.size());
    evidence.parallel_for(nodes.size(), [&](std::size_t i) {
        const auto answer = answer_to_heat(problem, current.fit, nodes[i]);
        if (!answer) return;
        ThermostatSearch search(evidence.run, current.fit.model, linearisation, *answer,
                                {&chiller, chiller.form("thermostat"), nodes[i]});
        screened[i] = search.over(felt_C(evidence, current, nodes[i]));
    });
    std::erase_if(screened, [](const Screened& one) { return one.log_likelihood_gain <= 0.0; });
    std::ranges::sort(screened, std::ranges::greater{}, &Screened::log_likelihood_gain);
    return screened;
}

bool switches_off(const Effect& effect, const Model& model, const Observation& seen) {
    return std::ranges::any_of(switchings_of(effect, model, seen),
                               [](const ThermostatSwitching& one) { return !one.on; });
}

std::optional<double> cycle_of(const Effect& effect, const Model& model, const Observation& seen) {
    if (!form_of(effect).steers_itself) return std::nullopt;
    std::vector<double> ons_s;
    for (const ThermostatSwitching& one : switchings_of(effect, model, seen)) {
        if (one.on) ons_s.push_back(one.time_s);
    }
    if (ons_s.size() < 2) return std::nullopt;
    return (ons_s.back() - ons_s.front()) / static_cast<double>(ons_s.size() - 1);
}

}  // namespace thermbal
