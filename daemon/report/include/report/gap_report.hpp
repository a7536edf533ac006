#pragma once

#include <string>
#include <vector>

#include "gap/diagnose.hpp"

namespace thermbal {

/// One sentence that needs no knowledge of the catalogue: what was missing, where, since when, how large,
/// with the 90 % interval of its size.
std::string effect_in_words(const FoundEffect& found);

/// Of each alternative the experiment that parts it best from the effect, whether that is enough or not.
std::vector<const SeparatingExperiment*> clearest_experiments(const FoundEffect& found);

/// A diagnosis as one HTML file that needs nothing else: verdict in plain words, gap before and after for
/// every run, the effects, the evidence of what else it might be, and per channel measured, before, after and
/// the residuals.
std::string gap_report_html(const Diagnosis& diagnosis);

}  // namespace thermbal
