#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

namespace thermbal::soak {

/// How long this process is kept from running: a thread that sleeps 2 ms at a time and sees how long it took.
class StallMeter {
  public:
    StallMeter()
        : thread_([this](const std::stop_token& stop) {
              using Clock = std::chrono::steady_clock;
              while (!stop.stop_requested()) {
                  const auto before = Clock::now();
                  std::this_thread::sleep_for(std::chrono::milliseconds(2));
                  const std::chrono::duration<double> slept = Clock::now() - before;
                  worst_s_ = std::max(worst_s_.load(), slept.count() - 0.002);
              }
          }) {}

    void reset() { worst_s_ = 0.0; }
    double worst_s() const { return worst_s_; }

  private:
    std::atomic<double> worst_s_ = 0.0;
    std::jthread thread_;
};

}  // namespace thermbal::soak
