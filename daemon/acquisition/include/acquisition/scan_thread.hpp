#pragma once

namespace thermbal {

/// Puts the calling thread before everything else that computes on this host, as far as this process may: the
/// lowest real-time priority (CAP_SYS_NICE or LimitRTPRIO=), else a high nice level, else at least a short
/// time slice and exact timers. For a thread that waits for a line most of the time; what it starts inherits
/// nothing of it.
void put_scan_thread_first();

}  // namespace thermbal
