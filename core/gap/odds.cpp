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
    const bool of_sensor = candidate.form->site == EffectSite::channel;
    return std::log(options.catalogue / kinds / forms / places *
                    (of_sensor ? options.share_of_sensors : 1.0));
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
    const double machine =
        evidence_at(survey, false, node_of_place(EffectSite::channel, contender.candidate.at, model));
    return std::max(0.0, machine - evidence_at(survey, true, contender.candidate.at));
}

double evidence_for(const Contender& contender, const OddsOptions& options) {
    return contender.on_the_run() + options.forecast_weight * contender.explanation.log_prediction;
}

/// Whether the two may be one cause: at one node or at neighbours, or the name acts everywhere.
bool may_be_the_same(const Contender& named, const Nameless& nameless, const Model& model) {
    const std::string node = node_of_place(named.candidate.form->site, named.candidate.at, model);
    if (node.empty()) return true;
    const std::string other =
        nameless.of_sensor ? node_of_place(EffectSite::channel, nameless.at, model) : nameless.at;
    const std::vector<std::string> around = neighbours(model, node);
    return node == other || std::ranges::find(around, other) != around.end();
}

/// Something without a name forecasts nothing, but a name must not win by forecasting roughly right what it
/// does not describe well: on the run itself it has to be as good as the nameless there. So the nameless gets
/// what the best forecast gains of the names that it may stand for.
double forecast_credit(const Nameless& nameless, const Survey& survey, const Model& model,
                       const OddsOptions& options) {
    double credit = 0.0;
    for (const Contender& contender : survey.contenders) {
        if (contender.explanation.log_prediction > credit && may_be_the_same(contender, nameless, model))
            credit = contender.explanation.log_prediction;
    }
    return options.forecast_weight * credit;
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
    for (const Nameless& one : survey.nameless) {
        const double worth = one.log_bayes_factor > 0.0 ? options.nameless_discount * one.log_bayes_factor +
                                                              forecast_credit(one, survey, model, options)
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
            std::size_t& best = odds.best_of[static_cast<std::size_t>(known - odds.kinds.begin())];
            if (named[i] > named[best]) {
                best = i;
                known->at = candidate.at;
                known->log_bayes_factor = evidence_for(survey.contenders[i], options);
            }
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
