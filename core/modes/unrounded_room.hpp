#pragma once

#include <optional>
#include <vector>

namespace thermbal {

/// The temperatures behind the readings of a room that drifts and whose sensor's step is coarser than its
/// noise: such readings are off by a sawtooth that lasts as long as the room takes from one to the next, up
/// to hours, and every channel follows the room. What they do say is when the room passed from one reading to
/// the next, and in between that it did not.
///
/// Ordered probit: a sample at mu + N(0, noise^2) reads the nearest multiple of the step; mu is a curve whose
/// slope changes little (at its posterior mode, never further from a reading than its rounding and its noise
/// can take it), the noise is the likeliest of a few. Nothing where the noise is above a third of the step:
/// then rounding is as good as more noise. Where the room moves faster than that curve bends (a door, a
/// thermostat), readings stay what they are, and so do gaps (NaN).
std::optional<std::vector<double>> unrounded_room(const std::vector<double>& values, double period_s);

}  // namespace thermbal
