#include "filter/denoise.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "base/median.hpp"
#include "within.hpp"

namespace thermbal {
namespace {

constexpr std::size_t fewest_samples = 8;
constexpr double mad_of_unit_normal = 0.6744897501960817;

/// From the finest details of the signal itself: an extension without noise would dilute them.
double noise_scale(std::span<const double> signal, const Wavelet& wavelet, const DenoiseOptions& options) {
    std::vector<double> finest = dwt(signal, wavelet, options.boundary).detail;
    for (double& value : finest) value = std::abs(value);
    return std::max(median(std::move(finest)) / mad_of_unit_normal, options.resolution_C / std::sqrt(12.0));
}

std::size_t usable_levels(std::size_t samples, std::size_t wanted) {
    std::size_t levels = 0;
    while (levels < wanted && (std::size_t{2} << levels) * 6 <= samples) ++levels;
    return std::max<std::size_t>(levels, 1);
}

/// Least-squares polynomial of y at 0, -1, -2, ... (the outermost sample first), evaluated at 1 ... count.
std::vector<double> extrapolated(std::span<const double> outermost_first, std::size_t degree,
                                 std::size_t count) {
    const auto span = static_cast<Eigen::Index>(outermost_first.size());
    const auto terms = static_cast<Eigen::Index>(std::min(degree, outermost_first.size() - 1)) + 1;
    const double scale = static_cast<double>(span);
    Eigen::MatrixXd powers(span, terms);
    for (Eigen::Index k = 0; k < span; ++k) {
        for (Eigen::Index p = 0; p < terms; ++p) {
            powers(k, p) = std::pow(-static_cast<double>(k) / scale, static_cast<double>(p));
        }
    }
    const Eigen::Map<const Eigen::VectorXd> y(outermost_first.data(), span);
    const Eigen::VectorXd coefficients = powers.householderQr().solve(y);
    std::vector<double> beyond(count);
    for (std::size_t k = 0; k < count; ++k) {
        const double x = static_cast<double>(k + 1) / scale;
        double value = 0.0;
        for (Eigen::Index p = terms; p-- > 0;) value = value * x + coefficients(p);
        beyond[k] = value;
    }
    return beyond;
}

/// `margin` extrapolated samples, the signal, `margin` extrapolated samples.
std::vector<double> extend_by_polynomials(std::span<const double> signal, std::size_t margin,
                                          const DenoiseOptions& options) {
    const std::size_t half = signal.size() / 2;
    const auto oldest = signal.first(std::min(options.oldest_span, half));
    const auto newest = signal.last(std::min(options.newest_span, half));
    const auto before = extrapolated(oldest, options.oldest_degree, margin);
    const std::vector<double> newest_first(newest.rbegin(), newest.rend());
    const auto after = extrapolated(newest_first, options.newest_degree, margin);
    std::vector<double> extended(before.rbegin(), before.rend());
    extended.insert(extended.end(), signal.begin(), signal.end());
    extended.insert(extended.end(), after.begin(), after.end());
    return extended;
}

double soft_threshold(double value, double threshold) {
    return std::copysign(std::max(std::abs(value) - threshold, 0.0), value);
}

Result<void> check_span(const char* name, std::size_t span, std::size_t degree) {
    if (span > degree && degree <= 5) return {};
    return fail(
        NextStep::refuse_input,
        fmt::format("{}_span = {} with {}_degree = {}: the degree must be at most 5 and below the span", name,
                    span, name, degree));
}

}  // namespace

Result<void> DenoiseOptions::check() const {
    if (auto known = wavelet_by_name(wavelet); !known) return std::unexpected(known.error());
    if (levels < 1 || levels > 12) {
        return fail(NextStep::refuse_input, fmt::format("levels = {}: must be 1 to 12", levels));
    }
    if (!within(resolution_C, 0.0, 10.0)) {
        return fail(NextStep::refuse_input, fmt::format("resolution_C = {}: must be 0 to 10", resolution_C));
    }
    if (auto newest = check_span("newest", newest_span, newest_degree); !newest) return newest;
    return check_span("oldest", oldest_span, oldest_degree);
}

Result<Denoised> denoise(std::span<const double> temperature_C, const DenoiseOptions& options) {
    if (auto checked = options.check(); !checked) return std::unexpected(checked.error());
    const std::size_t samples = temperature_C.size();
    if (samples < fewest_samples) {
        return fail(NextStep::refuse_input,
                    fmt::format("{} samples to filter: at least {} are needed", samples, fewest_samples));
    }
    if (!std::ranges::all_of(temperature_C, [](double value) { return std::isfinite(value); })) {
        return fail(NextStep::refuse_input, "a sample to filter is not a number; fill short gaps first");
    }
    const Wavelet wavelet = *wavelet_by_name(options.wavelet);
    Denoised result;
    result.levels = usable_levels(samples, options.levels);
    result.noise_sd_C = noise_scale(temperature_C, wavelet, options);
    result.threshold_C = result.noise_sd_C * std::sqrt(2.0 * std::log(static_cast<double>(samples)));

    const bool extends = options.extension == Extension::polynomial;
    const std::size_t margin = extends ? wavelet.length() << result.levels : 0;
    const std::vector<double> signal = extends
                                           ? extend_by_polynomials(temperature_C, margin, options)
                                           : std::vector<double>(temperature_C.begin(), temperature_C.end());
    auto decomposition = wavedec(signal, wavelet, options.boundary, result.levels);
    if (!decomposition) return std::unexpected(decomposition.error());
    for (auto& detail : decomposition->details) {
        for (double& value : detail) value = soft_threshold(value, result.threshold_C);
    }
    const auto rebuilt = waverec(*decomposition, wavelet, options.boundary);
    const auto first = rebuilt.begin() + static_cast<std::ptrdiff_t>(margin);
    result.values_C.assign(first, first + static_cast<std::ptrdiff_t>(samples));
    return result;
}

}  // namespace thermbal
