#include <algorithm>
#include <cmath>
#include <map>

#include "explanation.hpp"
#include "ground.hpp"
#include "residual_timing.hpp"
#include "thermostats.hpp"

namespace thermbal {
namespace {

constexpr double gain_to_refit = 1.5;         ///< nats of likelihood below which a full fit cannot help
constexpr double gain_behind_the_best = 0.6;  ///< share of the best gain that a candidate must promise
constexpr std::size_t most_refits = 24;
constexpr int most_of_a_kind = 3;
constexpr std::size_t most_forecasts = 12;
constexpr std::size_t most_polished = 4;
constexpr double close_to_the_best = 8.0;  ///< nats; to which a fifth of the best comes

std::vector<Screened> screen_all(const Evidence& evidence, const Explanation& current,
                                 const std::vector<Nameless>& nameless) {
    const ScreeningGround ground(evidence, current);
    const ResidualTiming timing = residual_timing(evidence.run, current.fit.point);
    const auto candidates = all_candidates(current.fit.model, evidence.room_columns);
    std::vector<Screened> screened(candidates.size());
    evidence.parallel_for(candidates.size(),
                          [&](std::size_t i) { screened[i] = screen(candidates[i], ground, timing); });
    for (std::size_t i = 0; i < candidates.size(); ++i)
        std::ranges::move(refined(screened[i], current.fit.model), std::back_inserter(screened));
    std::ranges::move(screen_thermostats(evidence, current, nameless), std::back_inserter(screened));
    std::ranges::sort(screened, std::ranges::greater{}, &Screened::log_likelihood_gain);
    return screened;
}

/// Those worth a full fit: the best places of every kind that promises something, the most promising kinds
/// first.
std::vector<Screened> worth_refitting(const std::vector<Screened>& screened) {
    std::vector<Screened> chosen;
    std::map<const EffectForm*, int> of_a_kind;
    for (const Screened& one : screened) {
        if (one.log_likelihood_gain < gain_to_refit || chosen.size() == most_refits) break;
        int& taken = of_a_kind[one.candidate.form];
        const bool near =
            one.log_likelihood_gain > gain_behind_the_best * screened.front().log_likelihood_gain;
        if (taken >= (near ? most_of_a_kind : 1)) continue;
        ++taken;
        chosen.push_back(one);
    }
    return chosen;
}

/// The model with the candidate, fitted with the neighbour's sensitivities, which are good as long as the
/// numbers stay near it; where that led nowhere, with its own.
Result<Explanation> fitted_with(const Evidence& evidence, const Explanation& current,
                                const Screened& screened) {
    if (form_of(screened.start).steers_itself) return explain_thermostat(evidence, current, screened);
    std::vector<Effect> effects = current.effects;
    effects.push_back(screened.start);
    auto quick = explain(evidence, std::move(effects), &current);
    if (!quick || quick->fit.point.chi2 < current.fit.point.chi2) return quick;
    return polish(evidence, *quick);
}

constexpr double nats_of_a_seen_cycle = 20.0;

/// How clearly a timer's cycle is seen to go to and fro, in nats: against the same heat all the time. What is
/// not seen to is a steady heat, whose name is another.
double nats_of_cycling(const Evidence& evidence, const Explanation& explanation) {
    Model steady = explanation.fit.model;
    Effect& effect = steady.effects.back();
    const auto duty = std::ranges::find(form_of(effect).parameters, "duty", &EffectParameterDefinition::name);
    const double all_the_time = duty->upper;
    effect.set_parameter("power_W", effect.parameter("power_W") * effect.parameter("duty") / all_the_time);
    effect.set_parameter("duty", all_the_time);
    const auto simulation = simulate_run(evidence, explanation, steady);
    if (!simulation) return 0.0;
    const Eigen::MatrixXd to_and_fro_C =
        explanation.fit.point.model_C - simulation->reading_C(Eigen::all, evidence.run.seen.sensors);
    return 0.5 * evidence.run.whitening(to_and_fro_C).squaredNorm();
}

/// What the catalogue believes of an effect's numbers says nothing of the run.
double chi2_without_prior_of_last_effect(const Fit& fit) {
    const Eigen::Index samples = fit.point.simulated_C.size();
    double chi2 = fit.point.chi2;
    for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
        if (!fit.parameters[i].of_effect || fit.parameters[i].effect + 1 < fit.model.effects.size()) continue;
        const double prior = fit.point.residual(samples + static_cast<Eigen::Index>(i));
        chi2 -= prior * prior;
    }
    return chi2;
}

/// How much better the run is described, its freedoms not paid for.
double nats_on_the_run(const Contender& contender, const Explanation& current) {
    return 0.5 * (current.fit.point.chi2 - chi2_without_prior_of_last_effect(contender.explanation.fit));
}

/// Better than this describes the run what sets in right with a change of speed and is no misfit of it.
constexpr double nats_beside_a_change = 60.0;

/// What sets in outside the run is only other numbers; what sets in right with a change of speed, and is not
/// plain, what the model itself says too roughly of that change. A thermostat that never switches off is heat
/// that sets in, a timer whose cycle is not seen a steady heat.
bool sets_in_on_its_own(const Evidence& evidence, const Explanation& current, const Contender& contender) {
    constexpr double bins = 5.0;
    const Observation& seen = evidence.run.seen;
    const Model& fitted = contender.explanation.fit.model;
    const Effect& effect = fitted.effects.back();
    if (form_of(effect).steers_itself && !switches_off(effect, fitted, seen)) return false;
    if (form_of(effect).name == "square_wave" &&
        nats_of_cycling(evidence, contender.explanation) < nats_of_a_seen_cycle)
        return false;
    const auto onset_s = onset_of(effect);
    if (!onset_s) return true;
    if (*onset_s < seen.time_s.front() || *onset_s > seen.time_s.back()) return false;
    if (contender.candidate.form->parameters.front().is_time) return true;
    const double beside_s = bins * seen.bin_s;
    // What begins with the run has another name.
    if (*onset_s < seen.time_s.front() + beside_s) return false;
    const auto changes_s = drive_changes_s(evidence.prior_model, seen.inputs);
    return nats_on_the_run(contender, current) > nats_beside_a_change ||
           std::ranges::none_of(changes_s,
                                [&](double change_s) { return std::abs(*onset_s - change_s) < beside_s; });
}

/// A mass that follows its node within two bins is the node's own heat capacity, of which the model has a
/// number already.
bool is_of_its_own(const Evidence& evidence, const Contender& contender) {
    constexpr double bins = 2.0;
    const Effect& effect = contender.explanation.fit.model.effects.back();
    const double follows_within_s =
        effect.parameter("heat_capacity_J_per_K") / effect.parameter("conductance_W_per_K");
    return !(follows_within_s < bins * evidence.run.seen.bin_s);  // NaN: no mass
}

/// What describes the run itself worse than nothing does is there to please the held-out runs: a misfit of
/// theirs dressed up.
bool describes_the_run(const Contender& contender, const Explanation& current) {
    constexpr double most_nats_lost = 2.0;
    return nats_on_the_run(contender, current) > -most_nats_lost;
}

std::vector<Contender> fitted(const Evidence& evidence, const Explanation& current,
                              const std::vector<Screened>& chosen) {
    std::vector<std::optional<Explanation>> explanations(chosen.size());
    evidence.parallel_for(chosen.size(), [&](std::size_t i) {
        auto explanation = fitted_with(evidence, current, chosen[i]);
        if (explanation) explanations[i] = std::move(*explanation);
    });
    std::vector<Contender> contenders;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
        if (explanations[i]) contenders.push_back({chosen[i].candidate, std::move(*explanations[i]), 0.0});
    }
    std::erase_if(contenders, [&](const Contender& one) {
        return !sets_in_on_its_own(evidence, current, one) || !is_of_its_own(evidence, one) ||
               !describes_the_run(one, current);
    });
    return contenders;
}

/// What the current explanation makes of every held-out run; none where it cannot be simulated.
std::vector<std::optional<Forecast>> forecasts_of(const Evidence& evidence, const Explanation& current) {
    std::vector<std::optional<Forecast>> result(evidence.holdouts.size());
    for (std::size_t k = 0; k < result.size(); ++k) {
        auto one = forecast(evidence.holdouts[k], evidence, current);
        if (one) result[k] = std::move(*one);
    }
    return result;
}

/// How much better the run is described and, for the first `forecasting` contenders, the held-out runs are
/// predicted, than by the current explanation. Best first afterwards; a contender that cannot be weighed is
/// left out.
void weigh(const Evidence& evidence, const Explanation& current,
           const std::vector<std::optional<Forecast>>& references, std::size_t forecasting,
           std::vector<Contender>& contenders) {
    evidence.parallel_for(contenders.size(), [&](std::size_t i) {
        Explanation& explanation = contenders[i].explanation;
        for (std::size_t k = 0; i < forecasting && k < references.size(); ++k) {
            if (k == 0) explanation.log_prediction = 0.0;
            if (!references[k]) continue;
            // A thermostat's heat follows the temperature, jumps included: a neighbour's sensitivities say
            // nothing of it.
            const bool anew = form_of(explanation.effects.back()).steers_itself;
            const auto better = forecast(evidence.holdouts[k], evidence, explanation,
                                         anew ? nullptr : &references[k]->sensitivity);
            if (better) explanation.log_prediction += better->log_density - references[k]->log_density;
        }
        contenders[i].log_bayes_factor =
            explanation.log_evidence - current.log_evidence + explanation.log_prediction;
    });
    std::erase_if(contenders, [](const Contender& one) { return !std::isfinite(one.log_bayes_factor); });
    std::ranges::sort(contenders, std::ranges::greater{}, &Contender::log_bayes_factor);
}

/// Contenders for the name, fitted once more with sensitivities of their own. Returns how many.
std::size_t polish_leading(const Evidence& evidence, std::vector<Contender>& contenders) {
    std::size_t leading = 0;
    while (leading < std::min(contenders.size(), most_polished) &&
           contenders[leading].log_bayes_factor > contenders.front().log_bayes_factor - close_to_the_best -
                                                      0.2 * std::abs(contenders.front().log_bayes_factor))
        ++leading;
    evidence.parallel_for(leading, [&](std::size_t i) {
        auto polished = polish(evidence, contenders[i].explanation);
        if (polished) contenders[i].explanation = std::move(*polished);
    });
    return leading;
}

}  // namespace

Survey survey(const Evidence& evidence, const Explanation& current) {
    Survey result;
    result.nameless = nameless_explanations(FitProblem(evidence.run, current.fit.model), current.fit);
    result.contenders =
        fitted(evidence, current, worth_refitting(screen_all(evidence, current, result.nameless)));
    weigh(evidence, current, {}, 0, result.contenders);
    const auto references = forecasts_of(evidence, current);
    weigh(evidence, current, references, most_forecasts, result.contenders);
    weigh(evidence, current, references, polish_leading(evidence, result.contenders), result.contenders);
    return result;
}

}  // namespace thermbal
