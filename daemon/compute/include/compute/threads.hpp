#pragma once

#include "base/parallel.hpp"

namespace thermbal {

/// A ParallelFor on `threads` threads, made for each call and gone after it. With low_priority they give way
/// to every other thread of the machine (nice 10), so that a scan never waits for a computation.
ParallelFor parallel_on_threads(int threads, bool low_priority);

}  // namespace thermbal
