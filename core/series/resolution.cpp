#include "series/resolution.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace thermbal {

double smallest_step(std::span<const double> values) {
    std::vector<double> sorted;
    for (const double value : values) {
        if (!std::isnan(value)) sorted.push_back(value);
    }
    std::ranges::sort(sorted);
    double step = 0.0;
    for (std::size_t k = 1; k < sorted.size(); ++k) {
        const double difference = sorted[k] - sorted[k - 1];
        if (difference > 1e-6 && (step == 0.0 || difference < step)) step = difference;
    }
    return step;
}

}  // namespace thermbal
