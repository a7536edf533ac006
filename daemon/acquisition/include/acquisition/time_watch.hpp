#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/clock.hpp"
#include "acquisition/scan.hpp"

namespace thermbal {

/// Something about time that a person should know when reading the test.
struct TimeEvent {
    std::string kind;  ///< clock_step, suspended, scans_late, scans_missed, on_time
    std::string message;
};

/// Compares what the clocks did since the scan before, and whether the scans come when they are due. The grid
/// needs none of this: it runs on boot_ns. One for each test. Pure; one thread.
class TimeWatch {
  public:
    /// Once a scan, and at least as often as somebody wants to know of a suspend.
    std::vector<TimeEvent> take_clocks(const ClockReading& now);

    /// One event when scans begin to be late or missed, one when they are on time again: not one a scan.
    std::optional<TimeEvent> take_scan(const Scan& scan);

  private:
    std::optional<ClockReading> last_;
    ScanStatus trouble_ = ScanStatus::ok;
    std::int64_t trouble_first_scan_ = 0;
    std::int64_t trouble_scans_ = 0;
    int on_time_scans_ = 0;  ///< in a row
};

}  // namespace thermbal
