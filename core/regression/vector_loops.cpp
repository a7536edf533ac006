#include "regression/vector_loops.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "base/every_width.hpp"

namespace thermbal::vector_loops {
namespace {

constexpr std::size_t lanes = lane_count;
using Lanes = std::array<double, lanes>;
using Vector [[gnu::vector_size(lanes * sizeof(double))]] = double;

/// Always in the same order, whatever the processor.
inline double total(const Lanes& sums) {
    return ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]));
}

/// By reference: a vector that is returned would be passed in another way at every width.
[[gnu::always_inline]] inline void load(const double* from, Vector& vector) {
    std::memcpy(&vector, from, sizeof vector);
}

/// 2^k e^f with k = round(x / ln 2), |f| <= ln 2 / 2, e^f by its Taylor polynomial of degree 12.
[[gnu::always_inline]] inline double exp_of(double x) {
    constexpr double log2_e = 1.4426950408889634;
    constexpr double ln2_high = 6.93147180369123816490e-01;
    constexpr double ln2_low = 1.90821492927058770002e-10;
    constexpr double to_integer =
        6755399441055744.0;  // 1.5 * 2^52: the sum's low bits are the rounded integer
    const double shifted = x * log2_e + to_integer;
    const double k = shifted - to_integer;
    const double f = (x - k * ln2_high) - k * ln2_low;
    double p = 1.0 / 479001600.0;
    p = p * f + 1.0 / 39916800.0;
    p = p * f + 1.0 / 3628800.0;
    p = p * f + 1.0 / 362880.0;
    p = p * f + 1.0 / 40320.0;
    p = p * f + 1.0 / 5040.0;
    p = p * f + 1.0 / 720.0;
    p = p * f + 1.0 / 120.0;
    p = p * f + 1.0 / 24.0;
    p = p * f + 1.0 / 6.0;
    p = p * f + 0.5;
    p = p * f + 1.0;
    p = p * f + 1.0;
    const std::uint64_t exponent = (std::bit_cast<std::uint64_t>(shifted) + 1023) << 52;
    return p * std::bit_cast<double>(exponent);
}

}  // namespace

THERMBAL_EVERY_WIDTH
void multiply_rows(const double* __restrict matrix, std::size_t length, std::span<const std::ptrdiff_t> rows,
                   const double* __restrict factor, double constant, double* __restrict out) {
    // Four at a time: one sum alone waits for itself.
    std::size_t i = 0;
    for (; i + 4 <= rows.size(); i += 4) {
        std::array<Vector, 4> sums{};
        for (std::size_t k = 0; k < length; k += lanes) {
            Vector of_factor;
            load(factor + k, of_factor);
            for (std::size_t r = 0; r < 4; ++r) {
                Vector of_row;
                load(matrix + static_cast<std::size_t>(rows[i + r]) * length + k, of_row);
                sums[r] += of_factor * of_row;
            }
        }
        for (std::size_t r = 0; r < 4; ++r) out[i + r] = constant + total(std::bit_cast<Lanes>(sums[r]));
    }
    for (; i < rows.size(); ++i) {
        const double* const row = matrix + static_cast<std::size_t>(rows[i]) * length;
        Lanes sums{};
        for (std::size_t k = 0; k < length; k += lanes) {
            for (std::size_t lane = 0; lane < lanes; ++lane) sums[lane] += factor[k + lane] * row[k + lane];
        }
        out[i] = constant + total(sums);
    }
}

THERMBAL_EVERY_WIDTH
void add_rows(const double* __restrict matrix, std::size_t length, std::span<const std::ptrdiff_t> rows,
              std::span<const double> factors, double* __restrict out) {
    std::size_t i = 0;
    for (; i + 4 <= rows.size(); i += 4) {
        const double* const a = matrix + static_cast<std::size_t>(rows[i]) * length;
        const double* const b = matrix + static_cast<std::size_t>(rows[i + 1]) * length;
        const double* const c = matrix + static_cast<std::size_t>(rows[i + 2]) * length;
        const double* const d = matrix + static_cast<std::size_t>(rows[i + 3]) * length;
        for (std::size_t k = 0; k < length; ++k) {
            out[k] +=
                (factors[i] * a[k] + factors[i + 1] * b[k]) + (factors[i + 2] * c[k] + factors[i + 3] * d[k]);
        }
    }
    for (; i < rows.size(); ++i) {
        const double* const a = matrix + static_cast<std::size_t>(rows[i]) * length;
        for (std::size_t k = 0; k < length; ++k) out[k] += factors[i] * a[k];
    }
}

THERMBAL_EVERY_WIDTH
void subtract_columns(const double* const* matrix, std::size_t rows, std::size_t columns,
                      const double* __restrict factor, double* __restrict out) {
    std::size_t k = 0;
    for (; k + 4 <= columns; k += 4) {
        const double* __restrict a = matrix[k];
        const double* __restrict b = matrix[k + 1];
        const double* __restrict c = matrix[k + 2];
        const double* __restrict d = matrix[k + 3];
        for (std::size_t i = 0; i < rows; ++i) {
            out[i] -=
                (factor[k] * a[i] + factor[k + 1] * b[i]) + (factor[k + 2] * c[i] + factor[k + 3] * d[i]);
        }
    }
    for (; k < columns; ++k) {
        const double* __restrict a = matrix[k];
        for (std::size_t i = 0; i < rows; ++i) out[i] -= factor[k] * a[i];
    }
}

THERMBAL_EVERY_WIDTH
void squared_distances_to(const double* const* lagged, std::size_t rows, const double* __restrict point,
                          std::size_t lags, double* __restrict distance) {
    // Four vectors at a time stay in registers over all lags.
    std::size_t i = 0;
    for (; i + 4 * lanes <= rows; i += 4 * lanes) {
        std::array<Vector, 4> sums{};
        for (std::size_t l = 0; l < lags; ++l) {
            const double at = point[l];
            for (std::size_t v = 0; v < 4; ++v) {
                Vector difference;
                load(lagged[l] + i + v * lanes, difference);
                difference -= at;
                sums[v] += difference * difference;
            }
        }
        std::memcpy(distance + i, sums.data(), sizeof sums);
    }
    for (std::size_t k = i; k < rows; ++k) distance[k] = 0.0;
    for (std::size_t l = 0; l < lags; ++l) {
        const double at = point[l];
        const double* column = lagged[l];
        for (std::size_t k = i; k < rows; ++k) {
            const double difference = column[k] - at;
            distance[k] += difference * difference;
        }
    }
}

THERMBAL_EVERY_WIDTH
void exchange_squares(const double* __restrict leaving, double leaving_at, const double* __restrict entering,
                      double entering_at, std::size_t count, double* __restrict distance) {
    for (std::size_t i = 0; i < count; ++i) {
        const double out = leaving[i] - leaving_at;
        const double in = entering[i] - entering_at;
        distance[i] = std::max(distance[i] + (in * in - out * out), 0.0);
    }
}

THERMBAL_EVERY_WIDTH
void scaled_exp(double* __restrict values, std::size_t count, double factor) {
    for (std::size_t i = 0; i < count; ++i) values[i] = exp_of(factor * values[i]);
}

THERMBAL_EVERY_WIDTH
double weighted_gaussians(const double* __restrict centres, std::size_t count,
                          const double* __restrict weight, const double* __restrict point, std::size_t lags,
                          double factor) {
    Lanes sums{};
    const auto add = [&](std::size_t i, const Vector& distance) __attribute__((always_inline)) {
        const auto by_lane = std::bit_cast<Lanes>(distance);
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            sums[lane] += weight[i + lane] * exp_of(std::max(factor * by_lane[lane], -700.0));
        }
    };
    // Four at a time: one sum alone waits for itself.
    std::size_t i = 0;
    for (; i + 4 * lanes <= count; i += 4 * lanes) {
        std::array<Vector, 4> distance{};
        for (std::size_t l = 0; l < lags; ++l) {
            for (std::size_t v = 0; v < 4; ++v) {
                Vector difference;
                load(centres + l * count + i + v * lanes, difference);
                difference -= point[l];
                distance[v] += difference * difference;
            }
        }
        for (std::size_t v = 0; v < 4; ++v) add(i + v * lanes, distance[v]);
    }
    for (; i < count; i += lanes) {
        Vector distance{};
        for (std::size_t l = 0; l < lags; ++l) {
            Vector difference;
            load(centres + l * count + i, difference);
            difference -= point[l];
            distance += difference * difference;
        }
        add(i, distance);
    }
    return total(sums);
}

THERMBAL_EVERY_WIDTH
void loss_slopes(const double* __restrict residual, std::size_t count, const Tube& tube,
                 double* __restrict slope) {
    const double C = tube.C;
    const double epsilon = tube.epsilon;
    const double inverse = 1.0 / tube.smoothing;
    for (std::size_t i = 0; i < count; ++i) {
        const double above = std::min(std::max((residual[i] - epsilon) * inverse, 0.0), 1.0);
        const double below = std::min(std::max((-residual[i] - epsilon) * inverse, 0.0), 1.0);
        slope[i] = C * (above - below);
    }
}

THERMBAL_EVERY_WIDTH
Derivatives derivatives_along(const double* __restrict residual, const double* __restrict change, double t,
                              std::size_t count, const Tube& tube) {
    const double epsilon = tube.epsilon;
    const double inverse = 1.0 / tube.smoothing;
    Lanes first{};
    Lanes second{};
    const auto add = [&](std::size_t i, std::size_t lane) __attribute__((always_inline)) {
        const double moved = residual[i] - t * change[i];
        const double above = (moved - epsilon) * inverse;
        const double below = (-moved - epsilon) * inverse;
        const double slope = std::min(std::max(above, 0.0), 1.0) - std::min(std::max(below, 0.0), 1.0);
        const double over = std::max(above, below);
        first[lane] += slope * change[i];
        second[lane] += (over > 0.0 && over < 1.0) ? change[i] * change[i] : 0.0;
    };
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) {
        for (std::size_t lane = 0; lane < lanes; ++lane) add(i + lane, lane);
    }
    for (std::size_t lane = 0; i < count; ++i, ++lane) add(i, lane);
    return {tube.C * total(first), tube.C * inverse * total(second)};
}

}  // namespace thermbal::vector_loops
