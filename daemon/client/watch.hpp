#pragma once

#include "ask.hpp"

namespace thermbal {

/// `thermbalctl watch`: the live view in a terminal; elsewhere one line a scan and an event, and with json
/// one document a line: {"topic": ..., "params": ...}. Reconnects when the daemon restarts. Returns the exit
/// status.
int run_watch(const AskOptions& ask);

}  // namespace thermbal
