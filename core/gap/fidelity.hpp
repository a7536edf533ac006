#pragma once

#include "explanation.hpp"

namespace thermbal {

/// How far the channels of a run wander around an explanation that was fitted to it, as a share of their
/// range: each channel's most likely share, of which the median. What a missing effect does to a few channels
/// does not pass for wander.
double share_of_rise_seen(const FitData& data, const FitPoint& point, const ModelFidelity& fidelity);

/// Lets every channel of every run wander by this share of its range from now on. Fits made before do not
/// hold any more.
void allow_for(Evidence& evidence, double share_of_rise);

}  // namespace thermbal
