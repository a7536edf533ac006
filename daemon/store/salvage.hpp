#pragma once

#include <cstdint>

#include "store/store.hpp"

namespace thermbal {

/// Copies the test and the archive of the machines from a damaged database into a new one, as far as they can
/// still be read. The scans before `known.before_scan` that cannot become missed ones. Errors are those of
/// the new one only.
Result<void> salvage(const Reader& damaged, Store& fresh, const KnownTest& known, Moment now);

}  // namespace thermbal
