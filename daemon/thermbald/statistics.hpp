#pragma once

#include <cstddef>
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

}  // namespace thermbal
