#pragma once

#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "simulator/faults.hpp"

namespace thermbal {

/// A scenario: faults and when they come, as TOML.
///
///     [[fault]]
///     kind = "exception"   # a name of the fault catalogue
///     value = 4            # where the kind takes one
///     unit = 2             # or channel = "T7"; without: all
///     at_s = 600           # simulated time
///     for_s = 120          # without: for ever
///
/// Error (refuse_input): one line `FILE:LINE: found, accepted` for the first mistake. Touches no file.
Result<std::vector<Fault>> parse_scenario(std::string_view toml, std::string_view file_name);

}  // namespace thermbal
