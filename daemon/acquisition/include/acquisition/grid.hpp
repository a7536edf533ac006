#pragma once

#include <cmath>
#include <cstdint>

namespace thermbal {

inline std::int64_t period_ns_of(double period_s) {
    return std::llround(period_s * 1e9);
}

/// The scans of a test: scan k is due at start_ns + k * period_ns of the monotonic clock, whatever happened
/// to scan k - 1. Nothing accumulates, so the grid does not drift.
struct Grid {
    std::int64_t start_ns = 0;
    std::int64_t period_ns = 15'000'000'000;

    std::int64_t due_ns(std::int64_t scan) const { return start_ns + scan * period_ns; }

    /// The scan whose period holds now_ns; negative before the start.
    std::int64_t scan_at(std::int64_t now_ns) const {
        const std::int64_t since = now_ns - start_ns;
        return since >= 0 ? since / period_ns : -((-since + period_ns - 1) / period_ns);
    }
    double time_s(std::int64_t scan) const {
        return static_cast<double>(scan * period_ns) / 1e9;  // 15, not 15.000000000000002
    }
};

}  // namespace thermbal
