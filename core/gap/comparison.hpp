#pragma once

#include <string>

#include "fit.hpp"
#include "gap/diagnose.hpp"

namespace thermbal {

/// Both models against a run, scan by scan. `data`: the same run, thinned.
/// The start of every node is estimated for each model, within the noise of its first reading.
Result<RunComparison> compare_run(const std::string& name, const RecordedTest& test, const FitData& data,
                                  const Model& before, const Model& after);

}  // namespace thermbal
