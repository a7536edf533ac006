#pragma once

#include "gap/diagnose.hpp"
#include "search.hpp"

namespace thermbal {

/// The effects of a search in the words of a diagnosis: place, window, channels, numbers with their
/// uncertainty, what else it might be, and how much each closes (in the order in which they were taken).
/// `written`: the model with the effects that a file will hold. The numbers with their intervals are those of
/// the search, which knows the sensors' places.
Result<std::vector<FoundEffect>> describe_effects(const Evidence& evidence, const SearchResult& search,
                                                  const Model& written, const DiagnoseOptions& options);

/// Suspects with at least `least` probability.
std::vector<Suspect> suspects_of(const Odds& odds, double least);

}  // namespace thermbal
