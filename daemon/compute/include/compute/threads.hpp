#pragma once

#include "base/parallel.hpp"

namespace thermbal {

/// The calling thread gives way to every other one (nice 10, SCHED_BATCH: it never preempts).
void put_this_thread_last();

/// A ParallelFor on `threads` threads: the calling one, and others made for each call and gone after it. A
/// body may call it again; what runs at the same time shares the threads. With low_priority they give way to
/// every other thread of the machine, the calling one for good, so that a scan never waits for a computation.
/// Where the system gives no thread, those there are do all of it.
ParallelFor parallel_on_threads(int threads, bool low_priority);

}  // namespace thermbal
