#pragma once

#include <cstddef>
#include <span>

/// The loops in which the time goes, compiled once for every width of vector unit and chosen at run time. All
/// of them give the same bits on every processor: sums have eight fixed lanes, and multiply and add are not
/// fused.
namespace thermbal::vector_loops {

inline constexpr std::size_t lane_count = 8;
/// The next multiple of lane_count.
constexpr std::size_t padded(std::size_t count) {
    return (count + lane_count - 1) / lane_count * lane_count;
}

/// out[i] = constant + sum over k < length of factor[k] * matrix[rows[i] * length + k]. REQUIRES: length %
/// lane_count == 0.
void multiply_rows(const double* matrix, std::size_t length, std::span<const std::ptrdiff_t> rows,
                   const double* factor, double constant, double* out);

/// out[k] += sum over i of factors[i] * matrix[rows[i] * length + k], for k < length.
void add_rows(const double* matrix, std::size_t length, std::span<const std::ptrdiff_t> rows,
              std::span<const double> factors, double* out);

/// out[i] -= sum over columns k of factor[k] * matrix[k][i], for i < rows.
void subtract_columns(const double* const* matrix, std::size_t rows, std::size_t columns,
                      const double* factor, double* out);

/// distance[i] = sum over l < lags of (lagged[l][i] - point[l])^2, for i < rows.
void squared_distances_to(const double* const* lagged, std::size_t rows, const double* point,
                          std::size_t lags, double* distance);

/// distance[i] += (entering[i] - entering_at)^2 - (leaving[i] - leaving_at)^2, at least 0, for i < count. The
/// two may overlap.
void exchange_squares(const double* leaving, double leaving_at, const double* entering, double entering_at,
                      std::size_t count, double* distance);

/// values[i] = exp(factor * values[i]); factor * values[i] must lie in [-700, 0]. Error below 2e-16.
void scaled_exp(double* values, std::size_t count, double factor);

/// sum over i < count of weight[i] * exp(factor * |centre_i - point|^2), factor <= 0, lag l of centre i at
/// centres[l * count + i]. REQUIRES: count % lane_count == 0.
double weighted_gaussians(const double* centres, std::size_t count, const double* weight, const double* point,
                          std::size_t lags, double factor);

/// The epsilon-insensitive loss with its kink smoothed over `smoothing`: its slope is
/// C * clamp((|residual| - epsilon) / smoothing, 0, 1), with the sign of the residual.
struct Tube {
    double C = 1.0;
    double epsilon = 0.001;
    double smoothing = 1.0;
};

void loss_slopes(const double* residual, std::size_t count, const Tube& tube, double* slope);

/// First and second derivative along residual - t * change: sums of slope * change and of change^2 where it
/// bends.
struct Derivatives {
    double first = 0.0;
    double second = 0.0;
};
Derivatives derivatives_along(const double* residual, const double* change, double t, std::size_t count,
                              const Tube& tube);

}  // namespace thermbal::vector_loops
