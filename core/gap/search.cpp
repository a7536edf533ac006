#include "search.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <string>

#include "choice.hpp"
#include "thermostats.hpp"

namespace thermbal {
namespace {

std::string node_of(const Effect& effect, const Model& model) {
    return node_of_place(form_of(effect).site, effect.at, model);
}

/// Two names at one node, or two that set in at the same moment, are one cause that the catalogue does not
/// have, dressed up.
bool is_dressing_up(const Effect& one, const Effect& other, const Model& model) {
    constexpr double same_moment_s = 600.0;
    const std::string node = node_of(one, model);
    const auto from_s = onset_of(one), other_from_s = onset_of(other);
    return (!node.empty() && node == node_of(other, model)) ||
           (from_s && other_from_s && std::abs(*from_s - *other_from_s) < same_moment_s);
}

/// The steps that dress something up; and those at a neighbour of it, where it shows, too.
std::vector<std::size_t> dressed_up(const SearchResult& search) {
    const Model& model = search.current.fit.model;
    const std::size_t first = model.effects.size() - search.steps.size();
    const auto effect_of = [&](std::size_t step) -> const Effect& { return model.effects[first + step]; };
    std::vector<std::size_t> found;
    std::vector<std::string> around;
    for (std::size_t i = 0; i < search.steps.size(); ++i) {
        for (std::size_t j = 0; j < search.steps.size(); ++j) {
            if (i == j || !is_dressing_up(effect_of(i), effect_of(j), model)) continue;
            found.push_back(i);
            std::ranges::move(neighbours(model, node_of(effect_of(i), model)), std::back_inserter(around));
            break;
        }
    }
    for (std::size_t i = 0; i < search.steps.size(); ++i) {
        const bool is_known = std::ranges::find(found, i) != found.end();
        const bool is_around = std::ranges::find(around, node_of(effect_of(i), model)) != around.end();
        if (!is_known && is_around) found.push_back(i);
    }
    return found;
}

/// A name that was taken in doubt, and after which nothing more is missing, does describe what was seen.
void lift_doubt(SearchResult& search) {
    if (search.left.something_is_missing()) return;
    for (Step& step : search.steps) {
        if (!step.doubtful) continue;
        step.doubtful = false;
        step.odds = among_names(std::move(step.odds), search.left.nothing);
    }
}

/// The best of a survey becomes what the search stands at.
Result<void> stand_at(const Explanation& best, Evidence& evidence, SearchResult& search) {
    let_go_of_others(evidence, best.effects);
    const bool held_before = !evidence.run.seen.inputs.seen_switchings.empty();
    auto polished = polish_thermostats(evidence, best);
    if (polished) polished = hold_thermostats(evidence, *polished);
    if (polished && held_before) polished = hold_thermostats_anew(evidence, *polished);
    if (!polished) return std::unexpected(polished.error());
    search.current = std::move(*polished);
    return {};
}

/// Takes effects until nothing more is missing or nothing more has a name.
Result<void> take_effects(Evidence& evidence, SearchResult& search, const DiagnoseOptions& options) {
    while (true) {
        Survey found = survey(evidence, search.current);
        auto [support, odds] = choose(found, search.current.fit.model);
        const bool taken =
            support != Support::none && static_cast<int>(search.steps.size()) < options.max_effects;
        if (taken) {
            if (auto done = stand_at(best_of(found, odds).explanation, evidence, search); !done) return done;
            search.steps.push_back({search.current.effects.back(), odds, support == Support::relative});
        }
        if (!taken && !odds.kinds.empty())
            search.left_start = best_of(found, odds).explanation.effects.back();
        if (search.first_survey.nameless.empty()) search.first_survey = std::move(found);
        if (taken) continue;
        search.left = std::move(odds);
        return {};
    }
}

/// The first effect against all that it might be instead, the others staying; it, or what takes its place,
/// goes to the end. Nothing goes there when nothing speaks for it any more. True when the effects are not the
/// same afterwards.
Result<bool> look_again(Evidence& evidence, SearchResult& search) {
    const Effect old = search.current.effects.front();
    std::vector<std::size_t> others(search.current.effects.size() - 1);
    std::iota(others.begin(), others.end(), 1);
    auto without = explain_with_only(evidence, search.current, others);
    if (!without) return std::unexpected(without.error());
    let_go_of_others(evidence, without->effects);
    const Survey found = survey(evidence, *without);
    auto [support, odds] = choose(found, without->fit.model);
    search.steps.erase(search.steps.begin());
    if (support == Support::none) {
        search.current = std::move(*without);
        return true;
    }
    if (auto done = stand_at(best_of(found, odds).explanation, evidence, search); !done)
        return std::unexpected(done.error());
    const Effect& taken = search.current.effects.back();
    search.steps.push_back({taken, std::move(odds), support == Support::relative});
    return taken.kind != old.kind || taken.at != old.at;
}

/// The first effect to the end, as it is: nothing is another effect afterwards.
Result<bool> put_last(const Evidence& evidence, SearchResult& search) {
    std::vector<std::size_t> order(search.current.effects.size());
    std::iota(order.begin(), order.end(), 1);
    order.back() = 0;
    auto rotated = explain_with_only(evidence, search.current, order);
    if (!rotated) return std::unexpected(rotated.error());
    search.current = std::move(*rotated);
    std::ranges::rotate(search.steps, search.steps.begin() + 1);
    return false;
}

/// What is left may be what several names at its place only dress up: it is taken instead of them when that
/// describes the run better. True when it was.
Result<bool> take_instead(Evidence& evidence, SearchResult& search) {
    if (search.left.kinds.empty() || search.left.kinds.front().probability < 0.5) return false;
    const Effect& left = search.left_start;
    std::vector<std::size_t> kept;
    std::vector<Step> steps;
    for (std::size_t k = 0; k < search.steps.size(); ++k) {
        if (is_dressing_up(search.current.effects[k], left, search.current.fit.model)) continue;
        kept.push_back(k);
        steps.push_back(search.steps[k]);
    }
    if (kept.size() == search.steps.size()) return false;
    const auto without = explain_with_only(evidence, search.current, kept);
    if (!without) return std::unexpected(without.error());
    std::vector<Effect> effects = without->effects;
    effects.push_back(left);
    steps.push_back({left, search.left, false});
    auto instead = explain(evidence, std::move(effects), &*without);
    if (instead) instead = polish(evidence, *instead);
    if (!instead || instead->log_evidence < search.current.log_evidence) return false;
    search.steps = std::move(steps);
    if (auto done = stand_at(*instead, evidence, search); !done) return std::unexpected(done.error());
    return true;
}

}  // namespace

Result<SearchResult> search_effects(const Evidence& free, Explanation base, const DiagnoseOptions& options) {
    SearchResult search{{}, base, std::move(base), {}, {}, {}};
    Evidence evidence = free;  // with the thermostats held that the search stands at
    if (auto done = take_effects(evidence, search, options); !done) return std::unexpected(done.error());
    bool changed = false;
    const std::size_t taken = search.steps.size();
    // What several names dress up stays without one however often it is looked at.
    const bool look = taken > 1 && dressed_up(search).empty();
    for (std::size_t k = 0; look && k < taken; ++k) {
        // The last was taken with these others in place.
        const bool is_known = k + 1 == taken && !changed;
        const auto other = is_known ? put_last(evidence, search) : look_again(evidence, search);
        if (!other) return std::unexpected(other.error());
        changed = changed || *other;
    }
    if (changed) {
        if (auto done = take_effects(evidence, search, options); !done) return std::unexpected(done.error());
    }
    const auto other = take_instead(evidence, search);
    if (!other) return std::unexpected(other.error());
    if (*other) {
        if (auto done = take_effects(evidence, search, options); !done) return std::unexpected(done.error());
    }
    auto released = release_thermostats(evidence, std::move(search.current));
    if (!released) return std::unexpected(released.error());
    search.current = std::move(*released);
    lift_doubt(search);
    for (const std::size_t step : dressed_up(search)) search.steps[step].doubtful = true;
    return search;
}

}  // namespace thermbal
