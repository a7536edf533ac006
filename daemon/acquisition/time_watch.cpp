#include "acquisition/time_watch.hpp"

#include <cmath>

#include <fmt/format.h>

namespace thermbal {
namespace {

/// Far above what a time server slews in a scan (500 ppm of an hour are 1.8 s, of 15 s 7.5 ms) and what lies
/// between two reads of a clock.
constexpr double step_s = 0.5;
constexpr double slew = 1e-3;
constexpr double suspend_s = 0.1;
/// Scans in a row: a host that is held up now and then is said to be so once.
constexpr int on_time_again = 4;

double seconds(std::int64_t ns) {
    return static_cast<double>(ns) * 1e-9;
}

TimeEvent suspended(double asleep_s) {
    return {"suspended",
            fmt::format("the host slept for {:.1f} s: what it did not read meanwhile is missed", asleep_s)};
}

TimeEvent stepped(double by_s) {
    return {"clock_step",
            fmt::format("the wall clock was set {} by {:.1f} s; the grid of the test does not move, the "
                        "wall times of the scans from here on do",
                        by_s > 0.0 ? "forward" : "back", std::abs(by_s))};
}

}  // namespace

std::vector<TimeEvent> TimeWatch::take_clocks(const ClockReading& now) {
    std::vector<TimeEvent> events;
    if (last_) {
        const double passed_s = seconds(now.boot_ns - last_->boot_ns);
        const double asleep_s = passed_s - seconds(now.awake_ns - last_->awake_ns);
        if (asleep_s > suspend_s) events.push_back(suspended(asleep_s));
        const double stepped_s = seconds(now.wall_ns - last_->wall_ns) - passed_s;
        if (std::abs(stepped_s) > step_s + slew * passed_s) events.push_back(stepped(stepped_s));
    }
    last_ = now;
    return events;
}

std::optional<TimeEvent> TimeWatch::take_scan(const Scan& scan) {
    const bool trouble = scan.status == ScanStatus::late || scan.status == ScanStatus::missed;
    if (!trouble) {
        if (trouble_ == ScanStatus::ok || ++on_time_scans_ < on_time_again) return std::nullopt;
        trouble_ = ScanStatus::ok;
        return TimeEvent{"on_time",
                         fmt::format("scan {} is on time again, after {} that were not, from scan {} on",
                                     scan.scan, trouble_scans_, trouble_first_scan_)};
    }
    const bool is_new = trouble_ == ScanStatus::ok;
    const bool worse = trouble_ == ScanStatus::late && scan.status == ScanStatus::missed;
    if (is_new) {
        trouble_first_scan_ = scan.scan;
        trouble_scans_ = 0;
    }
    ++trouble_scans_;
    on_time_scans_ = 0;
    if (!is_new && !worse) return std::nullopt;
    trouble_ = scan.status;
    if (scan.status == ScanStatus::missed) {
        return TimeEvent{"scans_missed",
                         fmt::format("scan {} was not read: the host or the daemon was held up for longer "
                                     "than a period, or the daemon was not there",
                                     scan.scan)};
    }
    return TimeEvent{"scans_late", fmt::format("scan {} was read {:.2f} s late: the host is held up",
                                               scan.scan, seconds(scan.started_ns - scan.due_ns))};
}

}  // namespace thermbal
