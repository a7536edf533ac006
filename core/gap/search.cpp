#include "search.hpp"

#include <algorithm>

namespace thermbal {
namespace {

/// Something is missing, and the catalogue says what rather than only that.
bool has_a_name(const Odds& odds) {
    double named = 0.0;
    for (const Suspect& suspect : odds.kinds) named += suspect.probability;
    return odds.something_is_missing() && !odds.kinds.empty() && named > 0.5 &&
           odds.kinds.front().probability > odds.nameless;
}

const Contender& best_of(const Survey& survey, const Odds& odds) {
    return survey.contenders[odds.best_of.front()];
}

/// Takes effects until nothing more is missing or nothing more has a name.
Result<void> take_effects(const Evidence& evidence, SearchResult& search, const DiagnoseOptions& options) {
    while (true) {
        Survey found = survey(evidence, search.current);
        Odds odds = odds_of(found, search.current.fit.model);
        const bool taken = has_a_name(odds) && static_cast<int>(search.steps.size()) < options.max_effects;
        if (taken) {
            auto polished = polish(evidence, best_of(found, odds).explanation);
            if (!polished) return std::unexpected(polished.error());
            search.current = std::move(*polished);
            search.steps.push_back({search.current.effects.back(), odds});
        }
        if (search.first_survey.nameless.empty()) search.first_survey = std::move(found);
        if (taken) continue;
        search.left = std::move(odds);
        return {};
    }
}

/// The first effect against all that it might be instead, the others staying; it, or what takes its place, goes to the end.
/// Nothing goes there when nothing speaks for it any more. True when the effects are not the same afterwards.
Result<bool> look_again(const Evidence& evidence, SearchResult& search) {
    const Effect old = search.current.effects.front();
    const std::vector<Effect> others(search.current.effects.begin() + 1, search.current.effects.end());
    auto without = explain(evidence, others, nullptr);
    if (!without) return std::unexpected(without.error());
    const Survey found = survey(evidence, *without);
    Odds odds = odds_of(found, without->fit.model);
    search.steps.erase(search.steps.begin());
    if (!has_a_name(odds)) {
        search.current = std::move(*without);
        return true;
    }
    auto polished = polish(evidence, best_of(found, odds).explanation);
    if (!polished) return std::unexpected(polished.error());
    search.current = std::move(*polished);
    const Effect& taken = search.current.effects.back();
    search.steps.push_back({taken, std::move(odds)});
    return taken.kind != old.kind || taken.at != old.at;
}

}  // namespace

Result<SearchResult> search_effects(const Evidence& evidence, Explanation base, const DiagnoseOptions& options) {
    SearchResult search{{}, base, std::move(base), {}, {}};
    if (auto done = take_effects(evidence, search, options); !done) return std::unexpected(done.error());
    bool changed = false;
    const std::size_t taken = search.steps.size();
    for (std::size_t k = 0; taken > 1 && k < taken; ++k) {
        const auto other = look_again(evidence, search);
        if (!other) return std::unexpected(other.error());
        changed = changed || *other;
    }
    if (changed) {
        if (auto done = take_effects(evidence, search, options); !done) return std::unexpected(done.error());
    }
    return search;
}

}  // namespace thermbal
