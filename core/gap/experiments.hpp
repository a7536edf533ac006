#pragma once

#include <string>
#include <vector>

#include "explanation.hpp"
#include "gap/diagnose.hpp"

namespace thermbal {

/// What an effect might be instead, as fitted: the whole model with the other effect in its place.
struct Rival {
    std::string kind;
    std::string at;
    Model model;
};

/// The suspects that the data leave at least `least` probability, at most `most`, each fitted in full beside
/// `others`, the explanation without the effect that they stand against.
std::vector<Rival> fitted_rivals(const Evidence& evidence, const Explanation& others,
                                 const std::vector<Suspect>& suspects, double least, std::size_t most);

/// For every rival what each experiment of the length of the run would show: a cool-down, a second speed, a
/// step of the room's temperature, the second half of the run otherwise than the first. Both models are
/// simulated as they were fitted, no place of a sensor; the difference counts against the run's noise and
/// fidelity, beyond what going on unchanged would show. Rivals in their order, clearest experiment first.
std::vector<SeparatingExperiment> separating_experiments(const FitData& run, const Model& named,
                                                         const std::vector<Rival>& rivals);

}  // namespace thermbal
