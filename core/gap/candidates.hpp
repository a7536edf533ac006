#pragma once

#include <string>
#include <vector>

#include "fit.hpp"
#include "linearisation.hpp"
#include "network/effect.hpp"
#include "residual_timing.hpp"

namespace thermbal {

class ScreeningGround;

/// One effect of the catalogue at one place.
struct Candidate {
    const EffectDefinition* definition = nullptr;
    const EffectForm* form = nullptr;
    std::string at;
};

/// Every form of every kind at every place of the model where it is not yet, but those that are looked for in
/// another way: what steers itself (screen_thermostats), and what refines the first form (refined).
/// `columns`: those that may be the room's temperature (measured channels that the model has no sensor for).
std::vector<Candidate> all_candidates(const Model& model, const std::vector<std::string>& columns);

/// A candidate with the numbers from which a fit may begin, and what the linearised fit gains by it.
struct Screened {
    Candidate candidate;
    Effect start;
    double log_likelihood_gain = 0.0;
    std::vector<double> moments_s = {};  ///< of a thermostat: when it was seen to switch, on first
};

/// The forms that refine a screened one: its numbers, the further ones where the catalogue expects them.
std::vector<Screened> refined(const Screened& first, const Model& model);

/// When the spindle starts, and when a column that drives a source jumps.
std::vector<double> drive_changes_s(const Model& model, const Inputs& inputs);

/// Tries the candidate with its shape (onset, period, decay ...) on a grid, its size solved for at each.
/// `timing`: what the residual itself says of when.
Screened screen(const Candidate& candidate, const ScreeningGround& ground, const ResidualTiming& timing);

}  // namespace thermbal
