#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "compute/newest_first.hpp"
#include "gap/agreement.hpp"
#include "network/model.hpp"
#include "series/recorded_test.hpp"
#include "series/sample.hpp"

namespace thermbal {

/// A test so far, to be compared with its simulation.
struct ComparisonJob {
    std::uint64_t generation = 0;  ///< of the test; a result of an earlier one is of no use any more
    std::int64_t scan = 0;         ///< the newest of the window
    std::shared_ptr<const Model> model;
    TestWindow window;
    bool check = false;                    ///< whether they agree at all, too: a hundred times the work
    std::vector<std::string> disagreeing;  ///< channels that did not when it was checked last
};

/// One sensor of the model that is a channel of the test, at the newest scan. In C.
struct ChannelComparison {
    std::string channel;
    double measured_C = no_value;  ///< NaN without a good reading
    double simulated_C = no_value;
    double residual_C() const { return measured_C - simulated_C; }
};

struct ComparisonResult {
    std::uint64_t generation = 0;
    std::int64_t scan = 0;
    double seconds = 0.0;  ///< how long it took
    Result<std::vector<ChannelComparison>> channels;
    std::optional<Result<std::vector<ChannelAgreement>>> agreement;  ///< where a check was asked for
};

/// The model as it stands, driven by the test's inputs and started at its first readings, at the newest scan;
/// with `check` what check_agreement says of the whole test, which ends soon once `cancelled` says so. Pure.
/// Any thread.
ComparisonResult compare(const ComparisonJob& job, const Cancelled& cancelled = never_cancelled);

using Comparer = NewestFirst<ComparisonJob, ComparisonResult>;

}  // namespace thermbal
