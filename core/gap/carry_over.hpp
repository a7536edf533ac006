#pragma once

#include "gap/diagnose.hpp"

namespace thermbal {

/// Names that make those runs worse that nothing was fitted to are hardly what was missing: their probability
/// falls with the square of how much worse, `explained` becomes `partly_explained`, and the reason says so.
/// Call it when the runs have been compared.
void doubt_what_does_not_carry_over(Diagnosis& diagnosis);

}  // namespace thermbal
