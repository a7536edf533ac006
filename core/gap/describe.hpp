#pragma once

#include "gap/diagnose.hpp"
#include "search.hpp"

namespace thermbal {

/// The effects of a search in the words of a diagnosis: place, window, channels, numbers with their
/// uncertainty, what else it might be, and how much each closes (in the order in which they were taken).
Result<std::vector<FoundEffect>> describe_effects(const Evidence& evidence, const SearchResult& search,
                                                  const DiagnoseOptions& options);

/// Suspects with at least `least` probability.
std::vector<Suspect> suspects_of(const Odds& odds, double least);

}  // namespace thermbal
