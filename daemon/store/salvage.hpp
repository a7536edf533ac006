#pragma once

#include <cstdint>

#include "store/store.hpp"

namespace thermbal {

/// Copies the test and the archive of the machines from a damaged database into a new one, as far as they can
/// still be read. The scans before `known.before_scan` that cannot become missed ones; what the new one
/// refuses (a good sample without a value, a declaration that holds no JSON) counts as not readable. Errors
/// are those of the new one only, and never `refuse_input` for what was read.
Result<void> salvage(const Reader& damaged, Store& fresh, const KnownTest& known, Moment now);

}  // namespace thermbal
