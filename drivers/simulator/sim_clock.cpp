#include "simulator/sim_clock.hpp"

#include <algorithm>

#include <time.h>

namespace thermbal {

std::int64_t monotonic_ns() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

SimClock SimClock::scaled(double factor, std::int64_t epoch_ns) {
    SimClock clock;
    clock.factor_ = factor;
    clock.epoch_ns_ = epoch_ns;
    return clock;
}

SimClock SimClock::lockstep(double period_s) {
    SimClock clock;
    clock.period_s_ = period_s;
    return clock;
}

double SimClock::time_of_request_s(std::int64_t now_ns, bool begins_scan) {
    if (!is_lockstep()) return next_s(now_ns);
    if (begins_scan) ++scans_;
    return scans_ == 0 ? 0.0 : static_cast<double>(scans_ - 1) * period_s_;
}

double SimClock::next_s(std::int64_t now_ns) const {
    if (!is_lockstep()) return std::max(0.0, static_cast<double>(now_ns - epoch_ns_) * 1e-9 * factor_);
    return static_cast<double>(scans_) * period_s_;
}

}  // namespace thermbal
