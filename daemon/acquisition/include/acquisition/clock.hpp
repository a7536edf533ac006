#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <stop_token>

namespace thermbal {

/// The clocks of a host, read together.
struct ClockReading {
    std::int64_t boot_ns = 0;   ///< goes on while the host sleeps: what the grid runs on
    std::int64_t awake_ns = 0;  ///< stands still while the host sleeps
    std::int64_t wall_ns = 0;   ///< UTC since 1970; is set by people and time servers
};

/// The one place that reads time. Everything else takes it as an argument or asks a Clock. All members may be
/// called from any thread. monotonic_ns never jumps back and counts through a suspend; wall_ns is UTC since
/// 1970 and may jump.
class Clock {
  public:
    virtual ~Clock() = default;
    virtual std::int64_t monotonic_ns() const = 0;
    virtual std::int64_t wall_ns() const = 0;
    /// A clock that knows no sleep says monotonic_ns for both.
    virtual ClockReading read() const { return {monotonic_ns(), monotonic_ns(), wall_ns()}; }

    /// Blocks until monotonic_ns() >= deadline_ns (true), or a stop is requested or wakes() is no longer
    /// seen_wakes (false). Taking seen_wakes before looking at one's plan leaves no moment in which a wake()
    /// is lost.
    virtual bool sleep_until(std::int64_t deadline_ns, std::uint64_t seen_wakes,
                             const std::stop_token& stop) = 0;

    /// Ends every sleep_until under way, so that the sleeper looks at its plan again.
    virtual void wake() = 0;
    virtual std::uint64_t wakes() const = 0;

    /// All that was due until deadline_ns has been done. Only a clock that waits for the work (lockstep)
    /// cares.
    virtual void settled(std::int64_t deadline_ns) = 0;

    /// Nanoseconds of real time until this clock shows deadline_ns; for timers of the operating system.
    virtual std::int64_t real_ns_until(std::int64_t deadline_ns) const = 0;
};

/// CLOCK_MONOTONIC, whatever clock the grid runs on: how long something really took.
std::int64_t real_monotonic_ns();

/// CLOCK_BOOTTIME and CLOCK_REALTIME.
std::unique_ptr<Clock> system_clock();

/// Faster than time: (CLOCK_MONOTONIC - epoch_ns) * factor. Two processes that are given the same factor and
/// epoch agree on the time. Wall time starts at the real wall time of the epoch and runs `factor` times as
/// fast.
std::unique_ptr<Clock> scaled_clock(double factor, std::int64_t epoch_ns);

/// As fast as the work: time stands still until settled(t) says that what was due at t is done, and jumps to
/// the next deadline that somebody sleeps for. One sleeping thread at a time. Deterministic: what is computed
/// does not depend on how fast it is computed.
std::unique_ptr<Clock> lockstep_clock(std::int64_t start_ns, std::int64_t start_wall_ns);

}  // namespace thermbal
