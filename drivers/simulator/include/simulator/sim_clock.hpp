#pragma once

#include <cstddef>
#include <cstdint>

namespace thermbal {

/// CLOCK_MONOTONIC in ns: the same for every process of the machine. The simulator's only look at a clock.
std::int64_t monotonic_ns();

/// Simulated time, s. Scaled: it runs `factor` times as fast as CLOCK_MONOTONIC from `epoch_ns` on, so that a
/// daemon with the same two numbers agrees without a word. Lockstep: it stands still, and the begin of every
/// scan moves it on by one period; the first scan is at 0.
class SimClock {
  public:
    static SimClock scaled(double factor, std::int64_t epoch_ns);
    static SimClock lockstep(double period_s);

    /// The time at which a request is answered that arrives at `now_ns`. `begins_scan`: see
    /// ModbusModule::begins_scan.
    double time_of_request_s(std::int64_t now_ns, bool begins_scan);

    /// The time of whatever comes next: now, or in lockstep the next scan.
    double next_s(std::int64_t now_ns) const;
    bool is_lockstep() const { return period_s_ > 0.0; }

  private:
    double factor_ = 1.0;
    std::int64_t epoch_ns_ = 0;
    double period_s_ = 0.0;  ///< 0: scaled
    std::size_t scans_ = 0;
};

}  // namespace thermbal
