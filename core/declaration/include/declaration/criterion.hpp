#pragma once

#include <span>

#include "declaration/guard.hpp"

namespace thermbal {

/// The paper asks for a "distinct minimum" of RMSE over the number of lags n and leaves open what that is.
/// Ours, on y(n) = ln RMSE(n), since an RMSE is known by its ratio and not by its difference:
/// - scatter = 1.4826 median |second difference of y| / sqrt(6): the curve's own roughness;
/// - depth = upper decile of y - min(y): how far the minimum lies below the curve;
/// - falling = (lowest y up to edge_lags before the end) - min(y): what the last lags still gain.
/// The minimum is clear when it is deep, in itself and against the scatter, and when the curve has ended
/// before its last lags: turned, levelled off (falling <= edge_fall), or what they still gain is too little
/// in C to matter. On free runs that follow the filtered window down to its noise the curve ends in a floor,
/// and which n of it is lowest means nothing; what more lags gain there is what the filter has left of the
/// noise. A minimum at n = 1 is one: there is no smaller n, and a channel of one time constant is of first
/// order.
struct CriterionOptions {
    double min_depth = 0.1;  ///< ln: the minimum is at most 90 % of what few lags give
    double min_depth_in_scatters =
        4.0;           ///< of 35 values of white noise the lowest lies 3.4 below the upper decile
    int min_lags = 8;  ///< fewer usable n than this are no curve
    int edge_lags = 5;
    double edge_fall = 0.25;           ///< ln
    double edge_gain_C = 0.03;         ///< a seventh of the tolerance ...
    double edge_gain_in_noises = 0.5;  ///< ... or this in standard deviations of one reading
};

struct RmseMinimum {
    int n = 0;  ///< 1-based; 0 when the curve has no usable value
    double rmse_C = 0.0;
    double depth = 0.0;
    double scatter = 0.0;
    double falling = 0.0;
    double gain_C = 0.0;   ///< what `falling` is in C
    double noise_C = 0.0;  ///< standard deviation of one reading
    bool clear = false;
    Guard guard;  ///< "clear_minimum", with the figures above
};

/// `rmse_by_n_C[i]` belongs to n = i + 1; a value that is not finite and positive (a free run that diverged)
/// counts as worse than any other. `noise_C`: standard deviation of one reading, rounding included.
RmseMinimum find_minimum(std::span<const double> rmse_by_n_C, double noise_C,
                         const CriterionOptions& options);

}  // namespace thermbal
