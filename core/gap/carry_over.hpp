#pragma once

#include "gap/diagnose.hpp"

namespace thermbal {

/// An effect is not named to fill a gap that it does not close: where neither the run nor the held-out runs
/// are described better by a likelihood of independent readings, the names become suspects, the extended
/// model the calibrated one, and the verdict `agrees`, or `unexplained` where something had no name beside
/// them. Call it when the runs have been compared.
void withdraw_what_closes_no_gap(Diagnosis& diagnosis);

/// Names that make those runs worse that nothing was fitted to are hardly what was missing: their probability
/// falls with the square of how much worse, `explained` becomes `partly_explained`, and the reason says so.
/// Call it when the runs have been compared.
void doubt_what_does_not_carry_over(Diagnosis& diagnosis);

}  // namespace thermbal
