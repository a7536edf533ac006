#pragma once

#include <vector>

#include "fit.hpp"
#include "gap/diagnose.hpp"
#include "placebo.hpp"

namespace thermbal {

/// Where a fit's residual, smoothed over ten bins, is beyond three of what noise and fidelity leave of it;
/// worst first.
std::vector<Disagreement> disagreements_of(const FitData& data, const FitPoint& point,
                                           const ModelFidelity& fidelity);

/// What the nameless explanations say of place and course, best first, at most `count`; what each follows
/// among speed, ambient, own temperature and time.
std::vector<ResidualHeat> residual_heat_of(const FitData& data, const Model& model,
                                           const std::vector<Nameless>& nameless, std::size_t count);

}  // namespace thermbal
