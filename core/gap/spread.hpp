#pragma once

#include "explanation.hpp"

namespace thermbal {

/// How far the numbers of a model are off, over what the model states of them (relative_sigma): the share at
/// which the run is likeliest, linear around the fit; 1 at most, and not far below without reason. One run
/// determines so many of the numbers that it shows by how much the model missed them, and so how far those
/// may be off that it does not determine (empirical Bayes).
double spread_seen(const Evidence& evidence, const Fit& fit);

/// Takes the numbers of the model for as uncertain as that. Leaves fits that were made before as they are.
void take_for_spread(Evidence& evidence, double spread);

}  // namespace thermbal
