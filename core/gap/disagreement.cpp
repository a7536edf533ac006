#include "disagreement.hpp"

#include <algorithm>
#include <cmath>

namespace thermbal {
namespace {

constexpr Eigen::Index smooth_bins = 10;
constexpr double limit_sigmas = 3.0;

struct Smoothed {
    Eigen::VectorXd mean_C;
    Eigen::VectorXd sigmas;
};

Smoothed smooth(const FitData& data, const FitPoint& point, Eigen::Index column, double wander_C) {
    const Eigen::Index rows = point.difference_C.rows();
    Smoothed result{Eigen::VectorXd::Zero(rows), Eigen::VectorXd::Zero(rows)};
    for (Eigen::Index row = 0; row < rows; ++row) {
        double sum_C = 0.0, noise = 0.0;
        int count = 0;
        const Eigen::Index last = std::min(rows - 1, row + smooth_bins / 2);
        for (Eigen::Index k = std::max<Eigen::Index>(0, row - smooth_bins / 2); k <= last; ++k) {
            if (!std::isfinite(point.difference_C(k, column))) continue;
            sum_C += point.difference_C(k, column);
            noise += data.seen.sigma_C(k, column) * data.seen.sigma_C(k, column);
            ++count;
        }
        if (count == 0) continue;
        result.mean_C(row) = sum_C / count;
        result.sigmas(row) =
            std::abs(result.mean_C(row)) / std::sqrt(noise / (count * count) + wander_C * wander_C);
    }
    return result;
}

Disagreement summary(const FitData& data, const FitPoint& point, const Smoothed& smoothed,
                     Eigen::Index column, Eigen::Index from, Eigen::Index to) {
    Disagreement one{data.seen.channels[static_cast<std::size_t>(column)],
                     data.seen.time_s[static_cast<std::size_t>(from)],
                     data.seen.time_s[static_cast<std::size_t>(to)],
                     0.0,
                     0.0,
                     0.0};
    double sum = 0.0;
    int count = 0;
    for (Eigen::Index row = from; row <= to; ++row) {
        const double difference_C = point.difference_C(row, column);
        if (std::isfinite(difference_C)) {
            sum += difference_C * difference_C;
            ++count;
        }
        if (std::abs(smoothed.mean_C(row)) > std::abs(one.peak_C)) one.peak_C = smoothed.mean_C(row);
        one.sigmas = std::max(one.sigmas, smoothed.sigmas(row));
    }
    one.rms_C = count == 0 ? 0.0 : std::sqrt(sum / count);
    return one;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
    const auto n = static_cast<double>(a.size());
    double ma = 0.0, mb = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        ma += a[i] / n;
        mb += b[i] / n;
    }
    for (std::size_t i = 0; i < a.size(); ++i) {
        aa += (a[i] - ma) * (a[i] - ma);
        bb += (b[i] - mb) * (b[i] - mb);
        ab += (a[i] - ma) * (b[i] - mb);
    }
    return aa > 1e-12 && bb > 1e-12 ? ab / std::sqrt(aa * bb) : 0.0;
}

/// The reading nearest to a moment of a sensor on the node, or of the channel itself.
std::vector<double> own_temperature(const FitData& data, const Model& model, const Nameless& nameless) {
    std::vector<double> result(nameless.time_s.size(), 0.0);
    for (std::size_t column = 0; column < data.seen.columns(); ++column) {
        const Sensor& sensor = model.sensors[data.seen.sensors[column]];
        if ((nameless.of_sensor ? sensor.channel : sensor.node) != nameless.at) continue;
        for (std::size_t k = 0; k < result.size(); ++k) {
            const auto row =
                std::ranges::lower_bound(data.seen.time_s, nameless.time_s[k]) - data.seen.time_s.begin();
            const auto last = static_cast<std::ptrdiff_t>(data.seen.rows()) - 1;
            const double reading_C =
                data.seen.reading_C(std::min(row, last), static_cast<Eigen::Index>(column));
            if (std::isfinite(reading_C)) result[k] = reading_C;
        }
        break;
    }
    return result;
}

std::string what_it_follows(const FitData& data, const Model& model, const Nameless& nameless) {
    const std::vector<double> course(nameless.course.begin(), nameless.course.end());
    std::string best = "time";
    double strongest = 0.6;  // less is no following
    const auto try_driver = [&](const std::string& name, const std::vector<double>& driver) {
        const double strength = std::abs(correlation(course, driver));
        if (strength <= strongest) return;
        strongest = strength;
        best = name;
    };
    const auto recorded = [&](const std::string& column) {
        std::vector<double> values(nameless.time_s.size());
        std::ranges::transform(nameless.time_s, values.begin(),
                               [&](double time_s) { return value_at(data.seen.inputs, column, time_s); });
        return values;
    };
    for (const Source& source : model.sources) {
        if (!source.proportional_to.empty()) try_driver("speed", recorded(source.proportional_to));
    }
    if (!model.ambient.column.empty()) try_driver("ambient", recorded(model.ambient.column));
    try_driver("own temperature", own_temperature(data, model, nameless));
    return best;
}

}  // namespace

std::vector<Disagreement> disagreements_of(const FitData& data, const FitPoint& point,
                                           const ModelFidelity& fidelity) {
    std::vector<Disagreement> all;
    for (Eigen::Index column = 0; column < point.difference_C.cols(); ++column) {
        const Smoothed smoothed =
            smooth(data, point, column, fidelity.share_of_rise * data.seen.range_C(column));
        Eigen::Index from = -1, last = -1;
        const auto close = [&] {
            if (from >= 0 && last > from) all.push_back(summary(data, point, smoothed, column, from, last));
            from = -1;
        };
        for (Eigen::Index row = 0; row < point.difference_C.rows(); ++row) {
            if (smoothed.sigmas(row) > limit_sigmas) {
                if (from < 0) from = row;
                last = row;
            } else if (from >= 0 && row - last > 2 * smooth_bins) {
                close();
            }
        }
        close();
    }
    std::ranges::sort(all, std::ranges::greater{}, &Disagreement::sigmas);
    return all;
}

std::vector<ResidualHeat> residual_heat_of(const FitData& data, const Model& model,
                                           const std::vector<Nameless>& nameless, std::size_t count) {
    std::vector<ResidualHeat> result;
    for (const Nameless& one : nameless) {
        if (result.size() == count || one.log_bayes_factor < 3.0) break;
        const auto [from_s, to_s] = one.window_s();
        result.push_back({.at = one.at,
                          .of_sensor = one.of_sensor,
                          .log_bayes_factor = one.log_bayes_factor,
                          .from_s = from_s,
                          .to_s = to_s,
                          .time_s = one.time_s,
                          .course = {one.course.begin(), one.course.end()},
                          .sigma = {one.sigma.begin(), one.sigma.end()},
                          .follows = what_it_follows(data, model, one)});
    }
    return result;
}

}  // namespace thermbal
