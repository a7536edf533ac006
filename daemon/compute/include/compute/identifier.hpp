#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "base/error.hpp"
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

/// Identifies beside the scans: one job at a time on a thread of its own, the newest window first. A window
/// that is still waiting when a newer one comes is dropped; one under way is finished unless cancel() is
/// called.
class Identifier {
  public:
    using Identify = std::function<Result<WindowVerdict>(const IdentificationJob& job,
                                                         const std::function<bool()>& cancelled)>;

    /// `done` is called on the identifier's thread.
    Identifier(Identify identify, std::function<void(IdentificationResult)> done);
    ~Identifier();

    void submit(IdentificationJob job);
    /// Forgets the waiting job and ends the one under way as soon as it looks.
    void cancel();
    bool busy() const;

  private:
    void run(const std::stop_token& stop);

    const Identify identify_;
    const std::function<void(IdentificationResult)> done_;
    mutable std::mutex mutex_;
    std::condition_variable_any changed_;
    std::optional<IdentificationJob> waiting_;  // guarded by mutex_, as the rest
    bool working_ = false;
    std::uint64_t cancelled_before_ = 0;
    std::uint64_t job_number_ = 0;
    std::jthread thread_;  // last: it uses all of the above
};

}  // namespace thermbal
