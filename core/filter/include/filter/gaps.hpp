#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

struct GapOptions {
    std::size_t longest_filled = 20;  ///< scans; 5 min at 15 s
    std::size_t degree = 3;           ///< of the least-squares polynomial across a gap
    std::size_t neighbours = 8;  ///< samples on each side that it is fitted to, or as many as the gap is long

    /// Errors (refuse_input) name the field, its value and the bound.
    Result<void> check() const;
};

/// Filled values are an interpolation for the computation; they are never stored as samples.
struct FilledWindow {
    std::vector<double>
        values_C;           ///< the samples first ... first + values_C.size() - 1 of the input, no NaN left
    std::size_t first = 0;  ///< index of the first good sample
    std::size_t trailing_missing = 0;  ///< missing at the newest end: left out, never extrapolated
    std::size_t filled = 0;            ///< number of interpolated values
    std::size_t longest_gap = 0;       ///< between good samples, scans
    std::vector<bool> is_filled;       ///< as long as values_C
};

/// Fills gaps (NaN) between good samples by interpolation. Missing samples before the first and after the
/// last good one are left out. Errors (refuse_input): no good sample, a gap longer than longest_filled. Pure;
/// any thread.
Result<FilledWindow> fill_short_gaps(std::span<const double> temperature_C, const GapOptions& options);

/// The first good sample after the newest gap that is too long to be filled; 0 without one. Missing samples
/// at either end are no gap.
std::size_t after_last_long_gap(std::span<const double> temperature_C, const GapOptions& options);

}  // namespace thermbal
