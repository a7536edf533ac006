#include <algorithm>
#include <cmath>
#include <map>

#include "explanation.hpp"
#include "ground.hpp"
#include "periods.hpp"

namespace thermbal {
namespace {

constexpr double gain_to_refit = 1.5;         ///< nats of likelihood below which a full fit cannot help
constexpr double gain_behind_the_best = 0.6;  ///< share of the best gain that a candidate must promise
constexpr std::size_t most_refits = 24;
constexpr int most_of_a_kind = 3;
constexpr std::size_t most_forecasts = 12;

std::vector<Screened> screen_all(const Evidence& evidence, const Explanation& current) {
    const ScreeningGround ground(evidence, current);
    const auto periods_s = residual_periods_s(evidence.run, current.fit.point, 3);
    const auto candidates = all_candidates(current.fit.model, evidence.room_columns);
    std::vector<Screened> screened(candidates.size());
    evidence.parallel_for(candidates.size(),
                          [&](std::size_t i) { screened[i] = screen(candidates[i], ground, periods_s); });
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

/// How much better the contenders predict the held-out runs than the current explanation does.
void compare_forecasts(const Evidence& evidence, const Explanation& current,
                       std::vector<Contender>& contenders) {
    for (const FitData& holdout : evidence.holdouts) {
        const auto reference = forecast(holdout, evidence, current);
        if (!reference) continue;
        evidence.parallel_for(std::min(contenders.size(), most_forecasts), [&](std::size_t i) {
            Explanation& explanation = contenders[i].explanation;
            const auto better = forecast(holdout, evidence, explanation, &reference->sensitivity);
            if (better) explanation.log_prediction += better->log_density - reference->log_density;
        });
    }
}

double gained(const Explanation& with, const Explanation& without) {
    return with.log_evidence - without.log_evidence + with.log_prediction;
}

}  // namespace

Survey survey(const Evidence& evidence, const Explanation& current) {
    Survey result;
    const auto chosen = worth_refitting(screen_all(evidence, current));
    std::vector<std::optional<Explanation>> fitted(chosen.size());
    evidence.parallel_for(chosen.size(), [&](std::size_t i) {
        std::vector<Effect> effects = current.effects;
        effects.push_back(chosen[i].start);
        auto explanation = explain(evidence, std::move(effects), &current);
        if (explanation) fitted[i] = std::move(*explanation);
    });
    for (std::size_t i = 0; i < chosen.size(); ++i) {
        if (!fitted[i]) continue;
        const double worth = fitted[i]->log_evidence - current.log_evidence;
        result.contenders.push_back({chosen[i].candidate, std::move(*fitted[i]), worth});
    }
    std::ranges::sort(result.contenders, std::ranges::greater{}, &Contender::log_bayes_factor);
    compare_forecasts(evidence, current, result.contenders);
    for (Contender& contender : result.contenders) {
        contender.log_bayes_factor = gained(contender.explanation, current);
    }
    std::erase_if(result.contenders,
                  [](const Contender& one) { return !std::isfinite(one.log_bayes_factor); });
    std::ranges::sort(result.contenders, std::ranges::greater{}, &Contender::log_bayes_factor);
    const FitProblem problem(evidence.run, current.fit.model);
    result.nameless = nameless_explanations(problem, current.fit, Linearisation(current.fit));
    return result;
}

}  // namespace thermbal
