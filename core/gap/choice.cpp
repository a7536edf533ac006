#include "choice.hpp"

#include <utility>

namespace thermbal {
namespace {

constexpr double least_share_of_a_relative = 0.5;

Support support_of(const Survey& survey, const Odds& odds) {
    if (!odds.something_is_missing() || odds.kinds.empty()) return Support::none;
    double named = 0.0;
    for (const Suspect& suspect : odds.kinds) named += suspect.probability;
    if (named > 0.5 && odds.kinds.front().probability > odds.nameless) return Support::name;
    const Contender& best = best_of(survey, odds);
    return best.on_the_run() > least_share_of_a_relative * survey.nameless.front().log_bayes_factor &&
                   best.on_the_run() > 5.0
               ? Support::relative
               : Support::none;
}

}  // namespace

const Contender& best_of(const Survey& survey, const Odds& odds) {
    return survey.contenders[odds.best_of.front()];
}

Choice choose(const Survey& survey, const Model& model) {
    Odds odds = odds_of(survey, model);
    const Support support = support_of(survey, odds);
    if (support != Support::none || !odds.something_is_missing()) return {support, std::move(odds)};
    Odds by_the_run = odds_of(survey, model, {.forecast_weight = 0.0});
    if (support_of(survey, by_the_run) != Support::name ||
        best_of(survey, by_the_run).explanation.log_prediction < 0.0)
        return {support, std::move(odds)};
    return {Support::relative, std::move(by_the_run)};
}

}  // namespace thermbal
