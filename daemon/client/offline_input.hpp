#pragma once

#include "base/error.hpp"
#include "declaration/live_flow.hpp"
#include "offline.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

struct OfflineInput {
    TestWindow window;
    FlowOptions flow;
};

/// The recording on its own grid, and the live flow's options; everything that a person can have got wrong is
/// said.
Result<OfflineInput> read_input(const OfflineOptions& options);

/// Whether a channel is reported: named by --channel, or no channel was.
bool is_wanted(const OfflineOptions& options, const std::string& channel);

}  // namespace thermbal
