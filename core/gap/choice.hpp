#pragma once

#include "explanation.hpp"
#include "odds.hpp"

namespace thermbal {

/// What speaks for a next effect: nothing; the nearest relative of something without a name; a name.
enum class Support { none, relative, name };

/// What is taken next, and the odds that say so.
struct Choice {
    Support support;
    Odds odds;
};

/// Where two effects are missing, one may forecast best without describing the run, and the other describe
/// the run. The nameless, which has the forecast of the one, then beats both. What describes the run by
/// itself better than the nameless, and forecasts no worse than nothing, is taken in doubt: the doubt is
/// lifted when the other completes the picture.
Choice choose(const Survey& survey, const Model& model);

/// The contender that stands for the likeliest kind. REQUIRES: odds of this survey, with a kind.
const Contender& best_of(const Survey& survey, const Odds& odds);

}  // namespace thermbal
