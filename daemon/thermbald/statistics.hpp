#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace thermbal {

/// Quantiles of the newest values of a figure that the daemon measures of itself. Bounded memory.
class RecentFigures {
  public:
    explicit RecentFigures(std::size_t capacity = 8192) : capacity_(capacity) {}

    void add(double value);
    /// The q-quantile (0 ... 1) of what is kept; 0 when nothing is.
    double quantile(double q) const;
    double maximum() const { return maximum_; }  ///< of all that was ever added
    std::size_t count() const { return count_; }

  private:
    std::size_t capacity_;
    std::vector<double> kept_;
    std::size_t count_ = 0;
    double maximum_ = 0.0;
};

/// How many round trips took how long, since the daemon started.
class RoundTripHistogram {
  public:
    static constexpr std::array upper_ms = {1.0,   2.0,   5.0,   10.0,   20.0,  50.0,
                                            100.0, 200.0, 500.0, 1000.0, 2000.0};

    void add(double round_trip_ms);
    /// One more than upper_ms: the last one is everything above.
    const std::array<std::uint64_t, upper_ms.size() + 1>& counts() const { return counts_; }

  private:
    std::array<std::uint64_t, upper_ms.size() + 1> counts_{};
};

}  // namespace thermbal
