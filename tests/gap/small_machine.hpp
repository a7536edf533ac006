#pragma once

#include "network/model.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// Bearing - housing - bed, a sensor on each, friction in the bearing. Numbers known to 20 %.
Model small_machine();

/// With a second sensor, T4, on the housing; T2 reads the share more of its rise than the node's mean, T4
/// less.
Model with_two_on_the_housing(Model model, double share);

/// What a model's sensors read in `minutes` at a scan each 15 s, with normal noise. The spindle turns at 5000
/// rpm and stands from two thirds of the time on.
RecordedTest measured_on(const Model& model, double minutes, double noise_C, unsigned seed);

}  // namespace thermbal
