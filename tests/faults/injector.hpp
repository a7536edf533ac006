#pragma once

#include <chrono>
#include <cstdint>
#include <random>
#include <thread>
#include <vector>

#include "fault_draws.hpp"
#include "rig.hpp"

namespace thermbal::soak {

/// Brings one fault after the other (or up to three at once) at random moments, each for some scans, and some
/// clean scans between. A moment is a random time after a scan began, so that a fault finds exchanges half
/// done. Everything drawn from the seed; what the threads do meanwhile is not. Event loop only.
class Injector {
  public:
    Injector(Rig& rig, std::vector<FaultDraw> draws, double response_timeout_s, std::uint64_t seed);

    /// Before a scan may begin.
    void before_scan(bool last_scan_was_clean);
    /// Faults that have come and gone.
    std::int64_t done() const { return done_; }
    const std::vector<Fault>& current() const { return current_; }
    bool has(FaultKind kind) const;

  private:
    enum class Phase : std::uint8_t { clean, faulty, recovering };

    void begin();
    void at_a_random_moment(double within_s, std::function<void()> action);
    int drawn(int least, int most) { return std::uniform_int_distribution(least, most)(random_); }

    Rig& rig_;
    std::vector<FaultDraw> draws_;
    double response_timeout_s_;
    std::mt19937_64 random_;
    Phase phase_ = Phase::clean;
    int scans_left_ = 3;
    std::int64_t done_ = 0;
    std::vector<Fault> current_;
    std::jthread later_;
};

}  // namespace thermbal::soak
