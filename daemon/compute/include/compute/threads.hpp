#pragma once

#include "base/parallel.hpp"

namespace thermbal {

/// The calling thread gives way to every other one (nice 10, SCHED_BATCH: it never preempts).
void put_this_thread_last();

/// A ParallelFor on `threads` threads, made for each call and gone after it. With low_priority they give way
/// to every other thread of the machine, so that a scan never waits for a computation.
ParallelFor parallel_on_threads(int threads, bool low_priority);

}  // namespace thermbal
