#include "odds.hpp"

#include <algorithm>
#include <cmath>

namespace thermbal {
namespace {

double log_prior(const Candidate& candidate, const Model& model, const OddsOptions& options) {
    const double kinds = static_cast<double>(effect_catalogue().size());
    const double forms = static_cast<double>(candidate.definition->forms.size());
    const double places =
        std::max<double>(1.0, static_cast<double>(possible_places(*candidate.form, model).size()));
    return std::log(options.catalogue / kinds / forms / places);
}

/// How much better heat or an error of any course there describes the run than nothing does: none at all
/// where only its freedom counts.
double evidence_at(const Survey& survey, bool of_sensor, const std::string& at) {
    const auto found = std::ranges::find_if(
        survey.nameless, [&](const Nameless& one) { return one.of_sensor == of_sensor && one.at == at; });
    return found == survey.nameless.end() ? 0.0 : std::max(0.0, found->log_bayes_factor);
}

/// Sensor or machine: heat of any course in a node also shows at the neighbours, an error of any course of
/// its sensor shows nowhere else. By how much the first describes better what is seen, a name for the sensor
/// has to be better than others.
double doubt_of_sensor(const Contender& contender, const Survey& survey, const Model& model) {
    if (contender.candidate.form->site != EffectSite::channel) return 0.0;
    const auto sensor = find_sensor(model, contender.candidate.at);
    if (!sensor) return 0.0;
    const double machine = evidence_at(survey, false, model.sensors[*sensor].node);
    return std::max(0.0, machine - evidence_at(survey, true, contender.candidate.at));
}

double evidence_for(const Contender& contender, const OddsOptions& options) {
    return options.forecasts_count ? contender.log_bayes_factor : contender.on_the_run();
}

/// Something without a name forecasts nothing, but a name must not win by forecasting roughly right what it
/// does not describe well: on the run itself it has to be as good as the nameless. So the nameless gets what
/// the best forecast gains.
double forecast_credit(const Survey& survey, const OddsOptions& options) {
    double credit = 0.0;
    if (!options.forecasts_count) return credit;
    for (const Contender& contender : survey.contenders) {
        credit = std::max(credit, contender.explanation.log_prediction);
    }
    return credit;
}

}  // namespace

Odds odds_of(const Survey& survey, const Model& model, const OddsOptions& options) {
    double largest = std::log(options.nothing_missing);
    std::vector<double> named, nameless;
    for (const Contender& contender : survey.contenders) {
        named.push_back(evidence_for(contender, options) + log_prior(contender.candidate, model, options) -
                        doubt_of_sensor(contender, survey, model));
        largest = std::max(largest, named.back());
    }
    const double credit = forecast_credit(survey, options);
    for (const Nameless& one : survey.nameless) {
        const double worth = one.log_bayes_factor > 0.0
                                 ? options.nameless_discount * one.log_bayes_factor + credit
                                 : one.log_bayes_factor;
        nameless.push_back(worth + std::log(options.nameless / static_cast<double>(survey.nameless.size())));
        largest = std::max(largest, nameless.back());
    }
    Odds odds;
    odds.nothing = std::exp(std::log(options.nothing_missing) - largest);
    double total = odds.nothing;
    for (const double weight : nameless) odds.nameless += std::exp(weight - largest);
    total += odds.nameless;
    for (std::size_t i = 0; i < survey.contenders.size(); ++i) {
        const Candidate& candidate = survey.contenders[i].candidate;
        const double weight = std::exp(named[i] - largest);
        total += weight;
        const auto known = std::ranges::find(odds.kinds, candidate.definition->kind, &Suspect::kind);
        if (known != odds.kinds.end()) {
            known->probability += weight;
            continue;
        }
        odds.kinds.push_back(
            {candidate.definition->kind, candidate.at, weight, evidence_for(survey.contenders[i], options)});
        odds.best_of.push_back(i);
    }
    odds.nothing /= total;
    odds.nameless /= total;
    for (Suspect& suspect : odds.kinds) suspect.probability /= total;
    std::vector<std::size_t> order(odds.kinds.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::ranges::sort(order, std::ranges::greater{},
                      [&](std::size_t i) { return odds.kinds[i].probability; });
    Odds sorted{odds.nothing, odds.nameless, {}, {}};
    for (const std::size_t i : order) {
        sorted.kinds.push_back(odds.kinds[i]);
        sorted.best_of.push_back(odds.best_of[i]);
    }
    return sorted;
}

Odds among_names(Odds odds, double probability) {
    double named = 0.0;
    for (const Suspect& suspect : odds.kinds) named += suspect.probability;
    for (Suspect& suspect : odds.kinds) suspect.probability *= probability / named;
    odds.nameless = 1.0 - probability;
    odds.nothing = 0.0;
    return odds;
}

}  // namespace thermbal
