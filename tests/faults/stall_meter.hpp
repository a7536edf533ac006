#pragma once

#include <atomic>
#include <thread>

#include "simulator/endpoints.hpp"

namespace thermbal::soak {

/// How long this host keeps from running what a scan needs: a thread that sleeps 2 ms at a time and sees how
/// long it took, and sends a byte through a pseudo-terminal of its own, whose two ends are joined by a worker
/// of the kernel that has to wait its turn like any thread.
class StallMeter {
  public:
    StallMeter();

    void reset() { worst_s_ = 0.0; }
    /// The worst since reset, one that is not over yet included.
    double worst_s() const;

  private:
    void measure(const std::stop_token& stop);
    void ping() const;

    PtyEndpoint port_;
    std::atomic<double> worst_s_ = 0.0;
    std::atomic<double> since_s_ = 0.0;  ///< when the measurement under way began, on steady_clock
    std::jthread thread_;
};

}  // namespace thermbal::soak
