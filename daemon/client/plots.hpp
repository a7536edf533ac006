#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json.hpp>

namespace thermbal {

/// One line of `width` columns of a list of numbers and nulls, evenly thinned when it is longer; a null is a
/// blank. The scale is from the smallest to the largest value, at least `least_span`. In ASCII without
/// `unicode`.
std::string sparkline(const nlohmann::json& values, std::size_t width, bool unicode, double least_span = 0.5);

/// RMSE against n as bars, one line an n, `width` columns at most; the minimum and the chosen n are marked.
/// `curve` is one element of the list that the method `curve` answers.
std::string curve_plot(const nlohmann::json& curve, std::size_t width, bool unicode);

}  // namespace thermbal
