#include "residual_timing.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace thermbal {
namespace {

double power_at(const FitData& data, const FitPoint& point, double frequency_Hz) {
    const auto rows = data.seen.reading_C.rows();
    double power = 0.0;
    for (Eigen::Index column = 0; column < data.seen.reading_C.cols(); ++column) {
        std::complex<double> sum = 0.0;
        // One rotation a bin; the bins are regular but for gaps, where the angle is computed anew.
        std::complex<double> turn = 1.0;
        const std::complex<double> step =
            std::polar(1.0, -2.0 * std::numbers::pi * frequency_Hz * data.seen.bin_s);
        for (Eigen::Index row = 0; row < rows; ++row) {
            sum += point.residual(column * rows + row) * turn;
            turn *= step;
        }
        power += std::norm(sum);
    }
    return power;
}

std::vector<double> residual_periods_s(const FitData& data, const FitPoint& point, int count) {
    const double length_s = data.seen.time_s.back() - data.seen.time_s.front();
    struct Line {
        double period_s, power;
    };
    std::vector<Line> lines;
    std::vector<double> power;
    std::vector<double> frequency_Hz;
    for (double f = 3.0 / length_s; f < 0.25 / data.seen.bin_s; f += 0.25 / length_s) {
        frequency_Hz.push_back(f);
        power.push_back(power_at(data, point, f));
    }
    for (std::size_t k = 1; k + 1 < power.size(); ++k) {
        if (power[k] < power[k - 1] || power[k] < power[k + 1]) continue;
        const double curvature = power[k - 1] - 2.0 * power[k] + power[k + 1];
        const double shift = curvature < 0.0 ? 0.5 * (power[k - 1] - power[k + 1]) / curvature : 0.0;
        lines.push_back({1.0 / (frequency_Hz[k] + shift * 0.25 / length_s), power[k]});
    }
    std::ranges::sort(lines, std::ranges::greater{}, &Line::power);
    std::vector<double> periods_s;
    for (const Line& line : lines) {
        if (static_cast<int>(periods_s.size()) == count) break;
        periods_s.push_back(line.period_s);
    }
    return periods_s;
}

std::vector<double> residual_moments_s(const FitData& data, const FitPoint& point, std::size_t count) {
    constexpr Eigen::Index apart = 4;  ///< bins
    const auto rows = data.seen.reading_C.rows();
    const Eigen::VectorXd innovations = point.residual.head(data.seen.reading_C.size());
    const auto by_channel = innovations.reshaped(rows, data.seen.reading_C.cols());
    Eigen::VectorXd energy = by_channel.rowwise().squaredNorm();
    std::vector<double> moments_s;
    while (moments_s.size() < count) {
        Eigen::Index row = 0;
        if (energy.maxCoeff(&row) <= 0.0) break;
        moments_s.push_back(data.seen.time_s[static_cast<std::size_t>(row)]);
        const Eigen::Index from = std::max<Eigen::Index>(0, row - apart);
        energy.segment(from, std::min(rows, row + apart + 1) - from).setZero();
    }
    return moments_s;
}

}  // namespace

ResidualTiming residual_timing(const FitData& data, const FitPoint& point) {
    return {residual_periods_s(data, point, 3), residual_moments_s(data, point, 10)};
}

}  // namespace thermbal
