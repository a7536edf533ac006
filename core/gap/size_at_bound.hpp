#pragma once

#include "explanation.hpp"

namespace thermbal {

/// The same with every one-sided size within three standard deviations of its lower bound at what is to be
/// expected of it instead, all other numbers fitted to that. A run may say next to nothing of a size: the
/// likeliest one is then none, though the name is not in doubt, and all that is known is how far beyond the
/// bound it may be. A size of which the run says nothing at all stays where it is. Errors: those of the fit.
Result<Explanation> with_expected_sizes(const Evidence& evidence, const Explanation& explanation);

/// Mean of a normal distribution of which only what is above a bound is left.
double mean_above(double bound, double mean, double sigma);

}  // namespace thermbal
