#pragma once

#include <string>
#include <vector>

#include "offline.hpp"

namespace thermbal {

struct CompareOptions {
    OfflineOptions recording;             ///< every_min: minutes between two windows
    std::vector<std::string> estimators;  ///< only these; empty: all
    std::string plot;                     ///< file to draw, .html or .svg; empty: none
};

/// `thermbalctl compare`: every estimator at every window of a complete recording, against its end. Returns
/// the exit status.
int run_compare(const CompareOptions& options);

}  // namespace thermbal
