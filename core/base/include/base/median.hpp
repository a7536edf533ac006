#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace thermbal {

/// The middle value; of an even number the upper of the two in the middle. REQUIRES: not empty, no NaN.
inline double upper_median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
}

/// The middle value; of an even number the mean of the two in the middle. REQUIRES: not empty, no NaN.
inline double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    if (values.size() % 2 == 1) return *middle;
    return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace thermbal
