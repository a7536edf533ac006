#include "filter/gaps.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

namespace thermbal {
namespace {

struct Gap {
    std::size_t first = 0;  ///< first missing
    std::size_t end = 0;    ///< first good again
    std::size_t length() const { return end - first; }
};

std::vector<Gap> gaps_between_good_samples(std::span<const double> values) {
    std::vector<Gap> gaps;
    for (std::size_t k = 0; k < values.size(); ++k) {
        if (std::isfinite(values[k])) continue;
        Gap gap{k, k};
        while (!std::isfinite(values[gap.end])) ++gap.end;
        gaps.push_back(gap);
        k = gap.end;
    }
    return gaps;
}

/// Good samples nearest to the gap, up to `count` on each side.
std::vector<std::size_t> neighbours_of(const Gap& gap, std::span<const double> values, std::size_t count) {
    std::vector<std::size_t> chosen;
    for (std::size_t k = gap.first, taken = 0; k-- > 0 && taken < count;) {
        if (std::isfinite(values[k])) chosen.push_back(k), ++taken;
    }
    for (std::size_t k = gap.end, taken = 0; k < values.size() && taken < count; ++k) {
        if (std::isfinite(values[k])) chosen.push_back(k), ++taken;
    }
    return chosen;
}

void fill(const Gap& gap, std::span<const double> values, const GapOptions& options, std::span<double> into) {
    const auto chosen = neighbours_of(gap, values, std::max(options.neighbours, gap.length()));
    const auto rows = static_cast<Eigen::Index>(chosen.size());
    const auto terms = std::min<Eigen::Index>(static_cast<Eigen::Index>(options.degree) + 1,
                                              std::max<Eigen::Index>(rows / 2, 2));
    const double centre = 0.5 * static_cast<double>(gap.first + gap.end - 1);
    const double scale = static_cast<double>(gap.length() + options.neighbours);
    const auto power = [&](std::size_t k, Eigen::Index p) {
        return std::pow((static_cast<double>(k) - centre) / scale, static_cast<double>(p));
    };
    Eigen::MatrixXd powers(rows, terms);
    Eigen::VectorXd y(rows);
    for (Eigen::Index row = 0; row < rows; ++row) {
        const std::size_t k = chosen[static_cast<std::size_t>(row)];
        y(row) = values[k];
        for (Eigen::Index p = 0; p < terms; ++p) powers(row, p) = power(k, p);
    }
    const Eigen::VectorXd coefficients = powers.householderQr().solve(y);
    for (std::size_t k = gap.first; k < gap.end; ++k) {
        double value = 0.0;
        for (Eigen::Index p = 0; p < terms; ++p) value += coefficients(p) * power(k, p);
        into[k] = value;
    }
}

}  // namespace

Result<void> GapOptions::check() const {
    if (longest_filled > 240) {
        return fail(NextStep::refuse_input,
                    fmt::format("longest_filled = {}: must be 0 to 240 scans", longest_filled));
    }
    if (degree < 1 || degree > 3) {
        return fail(NextStep::refuse_input, fmt::format("degree = {}: must be 1 to 3", degree));
    }
    if (neighbours < 2 || neighbours > 100) {
        return fail(NextStep::refuse_input, fmt::format("neighbours = {}: must be 2 to 100", neighbours));
    }
    return {};
}

Result<FilledWindow> fill_short_gaps(std::span<const double> temperature_C, const GapOptions& options) {
    if (auto checked = options.check(); !checked) return std::unexpected(checked.error());
    const auto good = [](double value) { return std::isfinite(value); };
    const auto first = std::ranges::find_if(temperature_C, good);
    if (first == temperature_C.end()) return fail(NextStep::refuse_input, "the window has no good sample");
    const auto last = std::find_if(temperature_C.rbegin(), temperature_C.rend(), good);

    FilledWindow window;
    window.first = static_cast<std::size_t>(first - temperature_C.begin());
    window.trailing_missing = static_cast<std::size_t>(last - temperature_C.rbegin());
    const auto kept =
        temperature_C.subspan(window.first, temperature_C.size() - window.first - window.trailing_missing);
    window.values_C.assign(kept.begin(), kept.end());
    window.is_filled.assign(kept.size(), false);
    for (const Gap& gap : gaps_between_good_samples(kept)) {
        window.longest_gap = std::max(window.longest_gap, gap.length());
        if (gap.length() > options.longest_filled) {
            return fail(
                NextStep::refuse_input,
                fmt::format("{} samples in a row are missing from sample {} on: at most {} are interpolated",
                            gap.length(), window.first + gap.first, options.longest_filled));
        }
        fill(gap, kept, options, window.values_C);
        window.filled += gap.length();
        for (std::size_t k = gap.first; k < gap.end; ++k) window.is_filled[k] = true;
    }
    return window;
}

std::size_t after_last_long_gap(std::span<const double> temperature_C, const GapOptions& options) {
    std::size_t begin = 0;
    std::size_t missing = 0;
    bool any_good = false;
    for (std::size_t k = 0; k < temperature_C.size(); ++k) {
        if (!std::isfinite(temperature_C[k])) {
            ++missing;
            continue;
        }
        if (any_good && missing > options.longest_filled) begin = k;
        missing = 0;
        any_good = true;
    }
    return begin;
}

}  // namespace thermbal
