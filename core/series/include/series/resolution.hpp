#pragma once

#include <span>

namespace thermbal {

/// The smallest difference between two readings, NaN left out: the resolution as the data show it; 0 if all
/// are equal.
double smallest_step(std::span<const double> values);

}  // namespace thermbal
