#pragma once

#include <algorithm>
#include <cstdint>
#include <random>

namespace thermbal {

/// How long to leave a connection alone that could not be opened: doubling from `first_s` to `longest_s` with
/// every failure, a random part of it taken off so that the connections of a plant do not come back at the
/// same moment.
class Backoff {
  public:
    Backoff(double first_s, double longest_s, std::uint32_t seed)
        : first_s_(first_s), longest_s_(longest_s), next_s_(first_s), random_(seed) {}

    /// The pause after one more failure; at most longest_s.
    double failed_s() {
        const double nominal_s = std::min(next_s_, longest_s_);
        next_s_ = std::min(2.0 * nominal_s, longest_s_);
        return nominal_s * std::uniform_real_distribution(0.5, 1.0)(random_);
    }

    void succeeded() { next_s_ = first_s_; }

  private:
    double first_s_;
    double longest_s_;
    double next_s_;
    std::minstd_rand random_;
};

}  // namespace thermbal
