#include "acquisition/clock.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <time.h>

namespace thermbal {
namespace {

constexpr std::int64_t ns_per_s = 1'000'000'000;

std::int64_t read_ns(clockid_t id) {
    timespec now{};
    clock_gettime(id, &now);
    return now.tv_sec * ns_per_s + now.tv_nsec;
}

/// What every clock here shares: a sleep that wake() ends.
class WakeableClock : public Clock {
  public:
    void wake() override {
        {
            const std::lock_guard lock(mutex_);
            ++wakes_;
        }
        changed_.notify_all();
    }

    std::uint64_t wakes() const override {
        const std::lock_guard lock(mutex_);
        return wakes_;
    }

  protected:
    mutable std::mutex mutex_;
    std::condition_variable_any changed_;
    std::uint64_t wakes_ = 0;  // guarded by mutex_
};

/// Sleeping that wake() and a stop request can end. Subclasses say how much real time is left.
class SleepingClock : public WakeableClock {
  public:
    bool sleep_until(std::int64_t deadline_ns, std::uint64_t seen_wakes,
                     const std::stop_token& stop) override {
        // A host that is suspended does not advance the wait below, but does advance the clock: look again at
        // least this often, so that the first scan after a suspend is not one period late.
        constexpr std::int64_t look_again_ns = ns_per_s;
        std::unique_lock lock(mutex_);
        while (real_ns_until(deadline_ns) > 0) {
            const std::chrono::nanoseconds left(std::min(real_ns_until(deadline_ns), look_again_ns));
            if (changed_.wait_for(lock, stop, left, [&] { return wakes_ != seen_wakes; })) return false;
            if (stop.stop_requested()) return false;
        }
        return true;
    }

    void settled(std::int64_t /*deadline_ns*/) override {}
};

class SystemClock final : public SleepingClock {
  public:
    std::int64_t monotonic_ns() const override { return read_ns(CLOCK_BOOTTIME); }
    std::int64_t wall_ns() const override { return read_ns(CLOCK_REALTIME); }
    ClockReading read() const override {
        // Somebody may take the processor away between two of them: that is no suspend.
        constexpr std::int64_t together_ns = 5'000'000;
        ClockReading reading;
        for (int attempt = 0; attempt < 5; ++attempt) {
            reading = {read_ns(CLOCK_BOOTTIME), read_ns(CLOCK_MONOTONIC), read_ns(CLOCK_REALTIME)};
            if (read_ns(CLOCK_BOOTTIME) - reading.boot_ns < together_ns) break;
        }
        return reading;
    }
    std::int64_t real_ns_until(std::int64_t deadline_ns) const override {
        return deadline_ns - monotonic_ns();
    }
};

class ScaledClock final : public SleepingClock {
  public:
    ScaledClock(double factor, std::int64_t epoch_ns)
        : factor_(factor),
          epoch_ns_(epoch_ns),
          wall_at_epoch_ns_(read_ns(CLOCK_REALTIME) - (read_ns(CLOCK_MONOTONIC) - epoch_ns)) {}

    std::int64_t monotonic_ns() const override { return scaled(read_ns(CLOCK_MONOTONIC) - epoch_ns_); }
    std::int64_t wall_ns() const override { return wall_at_epoch_ns_ + monotonic_ns(); }
    std::int64_t real_ns_until(std::int64_t deadline_ns) const override {
        return std::llround(std::ceil(static_cast<double>(deadline_ns - monotonic_ns()) / factor_));
    }

  private:
    std::int64_t scaled(std::int64_t real_ns) const {
        return std::llround(static_cast<double>(real_ns) * factor_);
    }

    const double factor_;
    const std::int64_t epoch_ns_;
    const std::int64_t wall_at_epoch_ns_;
};

class LockstepClock final : public WakeableClock {
  public:
    LockstepClock(std::int64_t start_ns, std::int64_t start_wall_ns)
        : wall_offset_ns_(start_wall_ns - start_ns), now_ns_(start_ns), settled_ns_(start_ns) {}

    std::int64_t monotonic_ns() const override {
        const std::lock_guard lock(mutex_);
        return now_ns_;
    }
    std::int64_t wall_ns() const override { return monotonic_ns() + wall_offset_ns_; }

    bool sleep_until(std::int64_t deadline_ns, std::uint64_t seen_wakes,
                     const std::stop_token& stop) override {
        std::unique_lock lock(mutex_);
        if (deadline_ns <= now_ns_) return true;
        // Time may go on once the work that was due now is done.
        changed_.wait(lock, stop, [&] { return wakes_ != seen_wakes || settled_ns_ >= now_ns_; });
        if (stop.stop_requested() || wakes_ != seen_wakes) return false;
        now_ns_ = deadline_ns;
        return true;
    }

    void settled(std::int64_t deadline_ns) override {
        {
            const std::lock_guard lock(mutex_);
            settled_ns_ = std::max(settled_ns_, deadline_ns);
        }
        changed_.notify_all();
    }

    std::int64_t real_ns_until(std::int64_t deadline_ns) const override {
        return deadline_ns <= monotonic_ns() ? 0 : ns_per_s;
    }

  private:
    const std::int64_t wall_offset_ns_;
    std::int64_t now_ns_;  // guarded by mutex_, as the rest
    std::int64_t settled_ns_;
};

}  // namespace

std::int64_t real_monotonic_ns() {
    return read_ns(CLOCK_MONOTONIC);
}

std::unique_ptr<Clock> system_clock() {
    return std::make_unique<SystemClock>();
}

std::unique_ptr<Clock> scaled_clock(double factor, std::int64_t epoch_ns) {
    return std::make_unique<ScaledClock>(factor, epoch_ns);
}

std::unique_ptr<Clock> lockstep_clock(std::int64_t start_ns, std::int64_t start_wall_ns) {
    return std::make_unique<LockstepClock>(start_ns, start_wall_ns);
}

}  // namespace thermbal
