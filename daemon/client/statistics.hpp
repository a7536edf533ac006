#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace thermbal {

// Of no values: NaN.
double mean(const std::vector<double>& values);
double median(std::vector<double> values);
double root_mean_square(const std::vector<double>& values);

/// 95 % interval of a share of which `hits` of `trials` were seen (Wilson 1927); NaN without trials.
std::pair<double, double> wilson_interval(std::size_t hits, std::size_t trials);

}  // namespace thermbal
