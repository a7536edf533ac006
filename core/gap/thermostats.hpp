#pragma once

#include <optional>
#include <vector>

#include "candidates.hpp"
#include "explanation.hpp"

namespace thermbal {

/// Chillers that a thermostat switches, at the nodes where heat of an unknown course best describes the run:
/// the numbers from which a fit may begin, best first, at most one a node. When such a chiller runs follows
/// from the temperatures, so it is no multiple of one shape as the other candidates are. But what its
/// thermostat felt was measured: thresholds on the readings of its node say when it ran, and so how the
/// readings answer, its power solved for. `nameless`: best first.
std::vector<Screened> screen_thermostats(const Evidence& evidence, const Explanation& current,
                                         const std::vector<Nameless>& nameless);

/// Fits a screened one: first as a chiller that runs when it was seen to, all numbers free; then, from there
/// and with the temperatures at which that one switched, as a thermostat.
Result<Explanation> explain_thermostat(const Evidence& evidence, const Explanation& current,
                                       const Screened& screened);

/// As polish; where it has thermostats, each also by way of a chiller that runs when this explanation's does,
/// so that other nuisances do not lose its moments. The better fit of these.
Result<Explanation> polish_thermostats(const Evidence& evidence, const Explanation& explanation);

/// Holds the thermostats of an explanation: from now on each chiller of theirs runs when it does there, and
/// in the held-out runs when it is forecast to, whatever else is tried. What moves with every number is
/// nothing that a search could tell other effects from. The explanation, fitted with that.
Result<Explanation> hold_thermostats(Evidence& evidence, const Explanation& explanation);

/// The same once more where other effects have come to it: their moments were those of a fit that had to make
/// up for what these do. The explanation as it is where that is no better.
Result<Explanation> hold_thermostats_anew(Evidence& evidence, const Explanation& explanation);

/// No longer holds what is no effect of an explanation.
void let_go_of_others(Evidence& evidence, const std::vector<Effect>& effects);

/// The explanation with its held thermostats as thermostats again.
Result<Explanation> release_thermostats(const Evidence& held, Explanation explanation);

/// Whether a thermostat's chiller ever stops in a run.
bool switches_off(const Effect& effect, const Model& model, const Observation& seen);

/// How long a thermostat's cycle is in a run, mean; none for other effects, and where it does not cycle.
std::optional<double> cycle_of(const Effect& effect, const Model& model, const Observation& seen);

}  // namespace thermbal
