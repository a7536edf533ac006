#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "filter/wavelet.hpp"

namespace thermbal {

/// What stands beyond the ends of the window while it is transformed.
enum class Extension {
    boundary_mode,  ///< what the transform's own boundary mode makes of the outermost samples
    polynomial,     ///< least-squares polynomials of the first and the last part, `boundary` beyond them
};

struct DenoiseOptions {
    std::string wavelet = "db4";
    Boundary boundary = Boundary::smooth;
    Extension extension = Extension::polynomial;
    /// The newest samples are what a prediction starts from: a cubic through the last 80 (20 min at 15 s)
    /// bends them least.
    std::size_t newest_span = 80;
    std::size_t newest_degree = 3;
    /// The start is where a warm-up bends most: a short quadratic.
    std::size_t oldest_span = 20;
    std::size_t oldest_degree = 2;
    /// Detail levels that are thresholded; fewer on short windows (2^levels <= samples / 6).
    std::size_t levels = 4;
    /// The step of the module's rounding, C. The noise is never taken for less than resolution_C / sqrt(12).
    double resolution_C = 0.0;

    /// Errors (refuse_input) name the field, its value and the bound.
    Result<void> check() const;
};

struct Denoised {
    std::vector<double> values_C;
    double noise_sd_C = 0.0;  ///< median absolute deviation of the finest details / 0.6745
    double threshold_C =
        0.0;                 ///< noise_sd_C * sqrt(2 ln samples): Donoho and Johnstone's universal threshold
    std::size_t levels = 0;  ///< levels used
};

/// Soft universal thresholding of the wavelet details (Donoho & Johnstone 1994), as long as `temperature_C`.
/// Samples on a uniform grid, at least 8 of them, all finite; errors: refuse_input. Pure; any thread.
Result<Denoised> denoise(std::span<const double> temperature_C, const DenoiseOptions& options);

}  // namespace thermbal
