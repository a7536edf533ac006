#include "even_table.hpp"

#include <cmath>
#include <cstddef>

namespace thermbal {
namespace {

constexpr double steps_per_unit = 16.0;
constexpr double until = 64.0;
constexpr std::size_t steps = static_cast<std::size_t>(until * steps_per_unit);

}  // namespace

EvenTable::EvenTable(std::function<double(double)> function) : function_(std::move(function)) {
    values_.reserve(steps + 3);
    for (std::size_t i = 0; i < steps + 3; ++i)
        values_.push_back(function_(std::abs(static_cast<double>(i) - 1.0) / steps_per_unit));
}

double EvenTable::operator()(double x) const {
    if (!(x < until)) return function_(x);
    const double at = x * steps_per_unit;
    const auto i = static_cast<std::size_t>(at);
    const double u = at - static_cast<double>(i);
    const double* const f = &values_[i];
    // Lagrange's cubic through -1, 0, 1, 2.
    const double below = u + 1.0, left = u - 1.0, far = u - 2.0;
    return below * left * far * 0.5 * f[1] - u * left * far / 6.0 * f[0] - below * u * far * 0.5 * f[2] +
           below * u * left / 6.0 * f[3];
}

}  // namespace thermbal
