#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

/// The window's own range, mapped on [0, 1].
struct UnitScale {
    double minimum_C = 0.0;
    double range_C = 1.0;

    double to_unit(double temperature_C) const { return (temperature_C - minimum_C) / range_C; }
    double to_C(double unit) const { return minimum_C + unit * range_C; }
};

/// A series for autoregression with n lags: row i is the inputs T(i) ... T(i + n - 1), its target T(i + n),
/// all on [0, 1]. Rows overlap in `unit`; none is copied.
struct LagProblem {
    std::vector<double> unit;  ///< the scaled series
    UnitScale scale;
    std::size_t lags = 1;  ///< n

    std::size_t rows() const { return unit.size() - lags; }
    std::span<const double> input(std::size_t row) const { return std::span(unit).subspan(row, lags); }
    double target(std::size_t row) const { return unit[row + lags]; }
    std::span<const double> targets() const { return std::span(unit).subspan(lags); }
};

/// Scales and splits. Errors (refuse_input): a value that is not finite, no more samples than lags, lags = 0,
/// or a range below smallest_range_C (a flat channel has nothing to learn a course from).
Result<LagProblem> make_lag_problem(std::span<const double> temperature_C, std::size_t lags,
                                    double smallest_range_C);

}  // namespace thermbal
