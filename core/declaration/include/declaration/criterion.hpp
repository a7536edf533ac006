#pragma once

#include <span>

#include "declaration/guard.hpp"

namespace thermbal {

/// The paper asks for a "distinct minimum" of RMSE over the number of lags n and leaves open what that is. Ours, on
/// y(n) = ln RMSE(n), since an RMSE is known by its ratio and not by its difference:
///   scatter = 1.4826 * median |second difference of y| / sqrt(6)     the curve's own roughness
///   depth   = median(y) - min(y)                                     how far the minimum lies below the curve
/// The minimum is clear when depth >= min_depth and depth >= min_depth_in_scatters * scatter, and when it is no edge
/// of the curve (at n = 1 or at the largest n the curve has not been seen to rise again).
struct CriterionOptions {
    double min_depth = 0.15;             ///< ln: the minimum is at most 86 % of the typical RMSE
    double min_depth_in_scatters = 1.0;  ///< and stands out of the roughness
    int min_lags = 8;                    ///< fewer usable n than this are no curve
};

struct RmseMinimum {
    int n = 0;  ///< 1-based; 0 when the curve has no usable value
    double rmse_C = 0.0;
    double depth = 0.0;
    double scatter = 0.0;
    bool at_edge = false;
    bool clear = false;
    Guard guard;  ///< "clear_minimum", with the figures above
};

/// `rmse_by_n_C[i]` belongs to n = i + 1; a value that is not finite and positive (a free run that diverged) counts as
/// worse than any other.
RmseMinimum find_minimum(std::span<const double> rmse_by_n_C, const CriterionOptions& options);

}  // namespace thermbal
