#include "statistics.hpp"

#include <algorithm>
#include <cmath>

namespace thermbal {

void RecentFigures::add(double value) {
    if (kept_.size() < capacity_) {
        kept_.push_back(value);
    } else {
        kept_[count_ % capacity_] = value;
    }
    ++count_;
    maximum_ = count_ == 1 ? value : std::max(maximum_, value);
}

void RoundTripHistogram::add(double round_trip_ms) {
    const auto* const bucket = std::ranges::lower_bound(upper_ms, round_trip_ms);
    ++counts_[static_cast<std::size_t>(bucket - upper_ms.begin())];
}

double RecentFigures::quantile(double q) const {
    if (kept_.empty()) return 0.0;
    std::vector<double> sorted = kept_;
    const auto rank = static_cast<std::ptrdiff_t>(std::llround(q * static_cast<double>(sorted.size() - 1)));
    std::ranges::nth_element(sorted, sorted.begin() + rank);
    return sorted[static_cast<std::size_t>(rank)];
}

}  // namespace thermbal
