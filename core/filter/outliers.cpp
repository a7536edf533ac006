#include "filter/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "base/median.hpp"
#include "within.hpp"

namespace thermbal {
namespace {

constexpr double sd_per_mad = 1.482602218505602;

/// A sample against the robust line through its neighbours.
struct Deviation {
    double from_line_C = 0.0;
    double neighbour_mad_C = 0.0;
    bool known = false;
};

class NeighbourLine {
  public:
    NeighbourLine(std::span<const double> values, std::size_t half_width)
        : values_(values), half_width_(half_width) {}

    Deviation deviation(std::size_t k) {
        gather(k);
        if (at_.size() < 4 || !std::isfinite(values_[k])) return {};
        const double slope = theil_sen_slope();
        residuals_.clear();
        for (const std::size_t i : at_) residuals_.push_back(values_[i] - slope * offset(i, k));
        const double level = upper_median(residuals_);
        for (double& residual : residuals_) residual = std::abs(residual - level);
        return {values_[k] - level, upper_median(residuals_), true};
    }

  private:
    static double offset(std::size_t i, std::size_t k) {
        return static_cast<double>(i) - static_cast<double>(k);
    }

    void gather(std::size_t k) {
        at_.clear();
        const std::size_t from = k > half_width_ ? k - half_width_ : 0;
        const std::size_t to = std::min(values_.size(), k + half_width_ + 1);
        for (std::size_t i = from; i < to; ++i) {
            if (i != k && std::isfinite(values_[i])) at_.push_back(i);
        }
    }

    double theil_sen_slope() {
        slopes_.clear();
        for (std::size_t a = 0; a < at_.size(); ++a) {
            for (std::size_t b = a + 1; b < at_.size(); ++b) {
                slopes_.push_back((values_[at_[b]] - values_[at_[a]]) / offset(at_[b], at_[a]));
            }
        }
        return upper_median(slopes_);
    }

    std::span<const double> values_;
    std::size_t half_width_;
    std::vector<std::size_t> at_;
    std::vector<double> slopes_;
    std::vector<double> residuals_;
};

double overall_noise_sd_C(const std::vector<Deviation>& deviations, double smallest_C) {
    std::vector<double> sizes;
    for (const Deviation& deviation : deviations) {
        if (deviation.known) sizes.push_back(std::abs(deviation.from_line_C));
    }
    return sizes.empty() ? smallest_C : std::max(smallest_C, sd_per_mad * upper_median(sizes));
}

/// The newest finite sample before `end`, or 0.
std::size_t last_finite(std::span<const double> values, std::size_t end) {
    while (end > 1 && std::isnan(values[end - 1])) --end;
    return end == 0 ? 0 : end - 1;
}

/// A spike jumps away and back; beside the edge of a step, the next sample is like it.
bool jumps(double outside_C, double inside_C, const Deviation& inside) {
    return std::isnan(outside_C) || std::abs(outside_C - inside_C) > 0.5 * std::abs(inside.from_line_C);
}

void mark(std::size_t from, std::size_t end, bool newest, MarkedWindow& window) {
    for (std::size_t k = from; k < end; ++k) {
        double& value = window.values_C[k];
        if (std::isnan(value)) continue;
        value = std::numeric_limits<double>::quiet_NaN();
        if (newest) {
            ++window.undecided;
        } else {
            window.spikes.push_back(k);
        }
    }
}

}  // namespace

Result<void> OutlierOptions::check() const {
    if (half_width < 3 || half_width > 50) {
        return fail(NextStep::refuse_input, fmt::format("half_width = {}: must be 3 to 50", half_width));
    }
    if (!within(threshold, 3.0, 100.0)) {
        return fail(NextStep::refuse_input, fmt::format("threshold = {}: must be 3 to 100", threshold));
    }
    if (!within(smallest_noise_sd_C, 1e-6, 5.0)) {
        return fail(NextStep::refuse_input,
                    fmt::format("smallest_noise_sd_C = {}: must be 1e-6 to 5", smallest_noise_sd_C));
    }
    if (longest_spike < 1 || 2 * longest_spike >= half_width) {
        return fail(NextStep::refuse_input,
                    fmt::format("longest_spike = {}: must be at least 1 and below half_width / 2 = {}",
                                longest_spike, half_width / 2));
    }
    return {};
}

Result<MarkedWindow> mark_outliers(std::span<const double> temperature_C, const OutlierOptions& options) {
    if (auto checked = options.check(); !checked) return std::unexpected(checked.error());
    const std::size_t samples = temperature_C.size();
    NeighbourLine line(temperature_C, options.half_width);
    std::vector<Deviation> deviations(samples);
    for (std::size_t k = 0; k < samples; ++k) deviations[k] = line.deviation(k);
    const double noise_sd_C = overall_noise_sd_C(deviations, options.smallest_noise_sd_C);

    const auto stands_off = [&](std::size_t k) {
        const double local_sd_C = std::max(noise_sd_C, sd_per_mad * deviations[k].neighbour_mad_C);
        return deviations[k].known && std::abs(deviations[k].from_line_C) > options.threshold * local_sd_C;
    };
    MarkedWindow window;
    window.values_C.assign(temperature_C.begin(), temperature_C.end());
    for (std::size_t k = 0; k < samples; ++k) {
        if (!stands_off(k)) continue;
        std::size_t end = k;
        while (end < samples && (stands_off(end) || std::isnan(temperature_C[end]))) ++end;
        const std::size_t last = last_finite(temperature_C, end);
        const bool leaves =
            k == 0 || jumps(temperature_C[last_finite(temperature_C, k)], temperature_C[k], deviations[k]);
        const bool newest = end == samples;
        const bool returns = newest || jumps(temperature_C[end], temperature_C[last], deviations[last]);
        if (end - k <= options.longest_spike && leaves && returns) mark(k, end, newest, window);
        k = end;
    }
    return window;
}

}  // namespace thermbal
