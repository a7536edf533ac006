#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>

#include "base/error.hpp"
#include "compute/newest_first.hpp"
#include "declaration/live_flow.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// One window to identify, and what came of it.
struct IdentificationJob {
    std::uint64_t generation = 0;  ///< of the test; a result of an earlier one is of no use any more
    std::int64_t window_end_scan = 0;
    TestWindow window;
    std::set<std::string> settled;               ///< channels whose declaration stands
    std::shared_ptr<const FlowOptions> options;  ///< of the test; the same object for all its windows
};
struct IdentificationResult {
    std::uint64_t generation = 0;
    std::int64_t window_end_scan = 0;
    double seconds = 0.0;  ///< how long it took
    Result<WindowVerdict> verdict;
};

/// Identifies beside the scans.
class Identifier : public NewestFirst<IdentificationJob, IdentificationResult> {
  public:
    using Identify = std::function<Result<WindowVerdict>(const IdentificationJob& job,
                                                         const std::function<bool()>& cancelled)>;

    /// `done` is called on the identifier's thread.
    Identifier(Identify identify, std::function<void(IdentificationResult)> done);
};

}  // namespace thermbal
