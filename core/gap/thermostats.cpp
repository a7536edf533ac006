#include "thermostats.hpp"

#include <algorithm>
#include <utility>

#include "threshold_fit.hpp"

namespace thermbal {
namespace {

/// When the thermostat that an effect is switches in a run; none where it cannot be simulated.
std::vector<double> moments_of(const Effect& effect, const Model& model, const Observation& seen) {
    const auto simulation = simulate(model, seen.inputs, seen.time_s);
    return simulation ? moments_at(*simulation, effect.at) : std::vector<double>{};
}

/// When the thermostat at a node switches in the run as an explanation has it.
std::vector<double> moments_in(const Evidence& evidence, const Explanation& explanation,
                               const std::string& node) {
    const auto simulation = simulate_run(evidence, explanation, explanation.fit.model);
    return simulation ? moments_at(*simulation, node) : std::vector<double>{};
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
        std::vector<double> moments_s = moments_of(effect, model, holdout.seen);
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
    constexpr int most_rounds = 3;
    constexpr double worth_another = 0.02;  ///< of chi2
    auto best = polish(evidence, explanation);
    for (std::size_t k = 0; best && k < explanation.effects.size(); ++k) {
        const std::string& node = explanation.effects[k].at;
        if (!form_of(explanation.effects[k]).steers_itself || is_held(evidence, node)) continue;
        // The first time from where it was: a polish that lost the moments is no help.
        const Explanation* from = &explanation;
        for (int round = 0; round < most_rounds; ++round) {
            const double before = best->fit.point.chi2;
            const auto moments_s = moments_in(evidence, *from, node);
            if (moments_s.size() < on_off_on) break;
            const Evidence seen = as_seen(evidence, node, moments_s);
            auto scheduled = polish(seen, *from);
            auto freed = scheduled ? set_free(seen, std::move(*scheduled), k) : std::move(scheduled);
            if (freed && freed->fit.point.chi2 < before) best = std::move(freed);
            if (best->fit.point.chi2 > (1.0 - worth_another) * before) break;
            from = &*best;
        }
    }
    return best;
}

Result<Explanation> hold_thermostats(Evidence& evidence, const Explanation& explanation) {
    bool more = false;
    for (const Effect& effect : explanation.effects) {
        if (!form_of(effect).steers_itself || is_held(evidence, effect.at)) continue;
        const auto moments_s = moments_in(evidence, explanation, effect.at);
        if (moments_s.size() < on_off_on) continue;
        evidence = as_seen(std::move(evidence), effect.at, moments_s);
        hold_in_holdouts(evidence, effect, explanation.fit.model);
        more = true;
    }
    return more ? polish(evidence, explanation) : explanation;
}

Result<Explanation> hold_thermostats_anew(Evidence& evidence, const Explanation& explanation) {
    const auto released = release_thermostats(evidence, explanation);
    if (!released) return explanation;
    Evidence anew = evidence;
    let_go_of_others(anew, {});
    auto held = hold_thermostats(anew, *released);
    if (!held || held->fit.point.chi2 > explanation.fit.point.chi2) return explanation;
    evidence = std::move(anew);
    return held;
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

bool switches_off(const Effect& effect, const Model& model, const Observation& seen) {
    return moments_of(effect, model, seen).size() > 1;
}

std::optional<double> cycle_of(const Effect& effect, const Model& model, const Observation& seen) {
    if (!form_of(effect).steers_itself) return std::nullopt;
    const std::vector<double> moments_s = moments_of(effect, model, seen);
    if (moments_s.size() < on_off_on) return std::nullopt;
    const std::size_t cycles = (moments_s.size() - 1) / 2;
    return (moments_s[2 * cycles] - moments_s.front()) / static_cast<double>(cycles);
}

}  // namespace thermbal
