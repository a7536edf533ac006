#pragma once

#include <vector>

#include "explanation.hpp"
#include "odds.hpp"

namespace thermbal {

/// An effect that was taken, and what else it might have been while all the others taken are in the model.
struct Step {
    Effect start;  ///< with the catalogue's priors
    Odds odds;
    bool doubtful =
        false;  ///< the nearest relative in the catalogue of something that it does not describe well
};

/// What the search for missing effects ended with.
struct SearchResult {
    std::vector<Step> steps;
    Explanation base;     ///< no effects
    Explanation current;  ///< all that were taken
    Survey first_survey;  ///< what might be missing from the base
    Odds left;            ///< what might be missing still
    Effect left_start;    ///< the likeliest of it, with the catalogue's priors
};

/// Forward selection by evidence: the best candidate is taken while something is missing and a name for it is
/// more credible than none; then every effect taken earlier is looked at again with the later ones in place.
Result<SearchResult> search_effects(const Evidence& evidence, Explanation base,
                                    const DiagnoseOptions& options);

}  // namespace thermbal
