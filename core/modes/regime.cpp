#include "modes/regime.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "base/units.hpp"
#include "design.hpp"
#include "series/resolution.hpp"

namespace thermbal {

namespace {

constexpr double least_segment_min = 14.0;

void speed_changes(const TestWindow& window, const RegimeOptions& options,
                   std::vector<RegimeChange>& changes) {
    const Column* speed = window.input(options.speed_input);
    if (speed == nullptr || speed->values.empty()) return;
    double highest = 0.0;
    for (const double value : speed->values) {
        if (!std::isnan(value)) highest = std::max(highest, std::abs(value));
    }
    if (highest == 0.0) return;
    double held = std::nan("");
    for (std::size_t k = 0; k < speed->values.size(); ++k) {
        const double value = speed->values[k];
        if (std::isnan(value)) continue;
        const double change = value - held;
        if (!std::isnan(held) && std::abs(change) > options.speed_share * highest) {
            const bool stopped = std::abs(value) < options.speed_share * highest;
            changes.push_back({window.time_s(k), stopped ? RegimeKind::spindle_stop : RegimeKind::speed_step,
                               change, 1.0, true});
            held = value;
        }
        if (std::isnan(held)) held = value;
    }
}

void ambient_jumps(const TestWindow& window, std::string_view ambient, const RegimeOptions& options,
                   std::vector<RegimeChange>& changes) {
    const AmbientInput room = ambient_input(without_spikes(window), ambient, 15.0);
    if (!room.measured) return;
    const double per_min = seconds_per_min / window.period_s;
    const auto reach = static_cast<std::size_t>(std::lround(options.ambient_within_min * per_min));
    const std::size_t average = std::max<std::size_t>(1, reach / 3);
    if (window.scans < 2 * (reach + average)) return;
    std::vector<double> change(window.scans, 0.0);
    std::vector<double> usual;
    const auto mean_from = [&](std::size_t first) {
        double sum = 0.0;
        for (std::size_t k = first; k < first + average; ++k) sum += room.deviation_C[k];
        return sum / static_cast<double>(average);
    };
    for (std::size_t k = 0; k + reach + average <= window.scans; ++k) {
        change[k] = mean_from(k + reach) - mean_from(k);
        usual.push_back(std::abs(change[k]));
    }
    const auto high = usual.begin() + static_cast<std::ptrdiff_t>(0.7 * static_cast<double>(usual.size()));
    std::nth_element(usual.begin(), high, usual.end());
    const double threshold = std::max(options.ambient_jump_C, options.ambient_over_usual * *high);
    std::size_t k = 0;
    while (k < change.size()) {
        if (std::abs(change[k]) <= threshold) {
            ++k;
            continue;
        }
        std::size_t peak = k;
        const std::size_t last = std::min(change.size(), k + 2 * reach);
        for (std::size_t other = k; other < last; ++other) {
            if (std::abs(change[other]) > std::abs(change[peak])) peak = other;
        }
        const std::size_t middle = std::min(window.scans - 1, peak + (reach + average) / 2);
        changes.push_back({window.time_s(middle), RegimeKind::ambient_jump, change[peak], 1.0, false});
        k = peak + 2 * reach;
    }
}

/// What the channels of a segment leave over when everything that decays from its start is taken out.
struct Misfit {
    Eigen::MatrixXd span;      ///< orthonormal, blocks x rank
    Eigen::MatrixXd residual;  ///< blocks x channels, in units of the block noise
    Eigen::VectorXd noise_C;   ///< of a block mean

    /// Joint chi-square beyond the degrees of freedom, of all channels but the worst: one sensor that fails
    /// is no regime.
    double excess() const {
        const auto freedom = static_cast<double>(residual.rows() - span.cols());
        const Eigen::VectorXd each = residual.colwise().squaredNorm();
        if (each.size() == 1) return each[0] - freedom;
        return each.sum() - each.maxCoeff() - freedom * static_cast<double>(each.size() - 1);
    }
};

Eigen::MatrixXd orthonormal_span(const Eigen::MatrixXd& design) {
    constexpr double negligible = 1e-9;
    const Eigen::MatrixXd gram = design.transpose() * design;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
    const Eigen::VectorXd& values = solver.eigenvalues();
    Eigen::Index kept = 0;
    while (kept < values.size() && values[values.size() - 1 - kept] > negligible * values[values.size() - 1])
        ++kept;
    return design * solver.eigenvectors().rightCols(kept) *
           values.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
}

std::optional<Misfit> misfit_of(const TestWindow& window, std::string_view ambient, std::size_t per_block) {
    const AmbientInput room = ambient_input(window, ambient, 15.0);
    const Basis basis{logarithmic_grid(1.5, 600.0, 20), room.measured};
    const Eigen::MatrixXd design = block_design(basis, window, room, per_block);
    Misfit misfit;
    misfit.span = orthonormal_span(design);
    std::vector<Eigen::VectorXd> residuals;
    std::vector<double> noises;
    const auto rows = design.rows();
    if (rows < misfit.span.cols() + 4) return std::nullopt;
    for (const Column& column : window.channels) {
        if (column.name == ambient) continue;
        const BlockMeans blocks = block_means(column.values, rows, per_block);
        if (static_cast<double>(blocks.good) < 0.8 * static_cast<double>(window.scans)) continue;
        Eigen::VectorXd values = blocks.mean;
        for (Eigen::Index row = 1; row < rows; ++row) {
            if (blocks.count[row] == 0.0) values[row] = values[row - 1];
        }
        const double freedom = std::max(1.0, static_cast<double>(blocks.good) - static_cast<double>(rows));
        const double resolution = smallest_step(column.values);
        const double sample = std::max({blocks.within_sum / freedom, resolution * resolution / 6.0, 1e-6});
        const double noise = std::sqrt(sample / static_cast<double>(per_block));
        residuals.emplace_back((values - misfit.span * (misfit.span.transpose() * values)) / noise);
        noises.push_back(noise);
    }
    if (residuals.empty()) return std::nullopt;
    misfit.residual.resize(rows, static_cast<Eigen::Index>(residuals.size()));
    misfit.noise_C.resize(misfit.residual.cols());
    for (std::size_t i = 0; i < residuals.size(); ++i) {
        misfit.residual.col(static_cast<Eigen::Index>(i)) = residuals[i];
        misfit.noise_C[static_cast<Eigen::Index>(i)] = noises[i];
    }
    return misfit;
}

struct Kink {
    double explained = 0.0;
    double size_C = 0.0;
    Eigen::Index row = 0;
};

Eigen::MatrixXd kink_shape(Eigen::Index rows, Eigen::Index row, double block_min) {
    constexpr std::array<double, 2> response_min{4.0, 30.0};
    Eigen::MatrixXd shape = Eigen::MatrixXd::Zero(rows, 2);
    for (Eigen::Index k = row; k < rows; ++k) {
        const double since = (static_cast<double>(k - row) + 0.5) * block_min;
        for (Eigen::Index j = 0; j < shape.cols(); ++j) {
            shape(k, j) = -std::expm1(-since / response_min[static_cast<std::size_t>(j)]);
        }
    }
    return shape;
}

/// The joint chi-square that a kink at block `row` explains on all channels but the one it explains most on,
/// and its largest effect on a channel within the window.
Kink kink_at(const Misfit& misfit, Eigen::Index row, double block_min) {
    const Eigen::MatrixXd shape = kink_shape(misfit.residual.rows(), row, block_min);
    const Eigen::MatrixXd free = shape - misfit.span * (misfit.span.transpose() * shape);
    Eigen::Matrix2d normal = free.transpose() * free;
    normal.diagonal().array() += 1e-3;
    const Eigen::LLT<Eigen::Matrix2d> factor(normal);
    const Eigen::MatrixXd projected = free.transpose() * misfit.residual;
    const Eigen::MatrixXd coefficient = factor.solve(projected);
    Kink kink;
    kink.row = row;
    const Eigen::VectorXd each = projected.cwiseProduct(coefficient).colwise().sum();
    kink.explained = each.size() == 1 ? each[0] : each.sum() - each.maxCoeff();
    const Eigen::MatrixXd effect = (free * coefficient) * misfit.noise_C.asDiagonal();
    kink.size_C = effect.cwiseAbs().maxCoeff();
    return kink;
}

Kink best_kink(const Misfit& misfit, Eigen::Index first, Eigen::Index last, double block_min) {
    const Eigen::Index stride = std::max<Eigen::Index>(1, (last - first) / 60);
    Kink best;
    best.row = first;
    const auto consider = [&](Eigen::Index row) {
        const Kink kink = kink_at(misfit, row, block_min);
        if (kink.explained > best.explained) best = kink;
    };
    for (Eigen::Index row = first; row < last; row += stride) consider(row);
    const Eigen::Index around = best.row;
    for (Eigen::Index row = std::max(first, around - stride); row <= std::min(last - 1, around + stride);
         ++row) {
        consider(row);
    }
    return best;
}

/// Takes what a kink explains out of the misfit, so that the next one is looked for in the rest.
void absorb(Misfit& misfit, const Kink& kink, double block_min) {
    const Eigen::MatrixXd shape = kink_shape(misfit.residual.rows(), kink.row, block_min);
    const Eigen::MatrixXd free = shape - misfit.span * (misfit.span.transpose() * shape);
    const Eigen::MatrixXd added = orthonormal_span(free);
    misfit.residual -= added * (added.transpose() * misfit.residual);
    Eigen::MatrixXd span(misfit.span.rows(), misfit.span.cols() + added.cols());
    span << misfit.span, added;
    misfit.span = std::move(span);
}

std::vector<RegimeChange> unexplained_changes(const TestWindow& window, std::string_view ambient,
                                              const RegimeOptions& options) {
    constexpr int most = 5;
    std::vector<RegimeChange> changes;
    const double span_min = (window.end_s() - window.start_s) / seconds_per_min;
    if (window.scans == 0 || span_min < least_segment_min) return changes;
    const auto per_block =
        std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(seconds_per_min / window.period_s)));
    const double block_min = static_cast<double>(per_block) * window.period_s / seconds_per_min;
    std::optional<Misfit> misfit = misfit_of(window, ambient, per_block);
    if (!misfit) return changes;
    const auto first = static_cast<Eigen::Index>(options.earliest_kink_min / block_min);
    const Eigen::Index last =
        misfit->residual.rows() - static_cast<Eigen::Index>(options.kink_margin_min / block_min);
    while (changes.size() < most && misfit->excess() > options.kink_statistic) {
        const Kink kink = best_kink(*misfit, first, last, block_min);
        const double share = kink.explained / misfit->excess();
        if (kink.explained < options.kink_statistic || share < options.kink_share ||
            kink.size_C < options.kink_size_C) {
            break;
        }
        const auto scan = std::min(window.scans - 1, static_cast<std::size_t>(kink.row + 1) * per_block);
        changes.push_back({window.time_s(scan), RegimeKind::unexplained, kink.explained, share, true});
        absorb(*misfit, kink, block_min);
    }
    return changes;
}

}  // namespace

std::string_view to_string(RegimeKind kind) {
    switch (kind) {
        case RegimeKind::speed_step:
            return "speed step";
        case RegimeKind::spindle_stop:
            return "spindle stop";
        case RegimeKind::ambient_jump:
            return "ambient jump";
        case RegimeKind::unexplained:
            return "unexplained change";
    }
    return "unknown";
}

RegimeReport find_regime_changes(const TestWindow& window, std::string_view ambient,
                                 const RegimeOptions& options) {
    RegimeReport report;
    report.usable_from_s = window.start_s;
    report.last_change_s = window.start_s;
    if (window.scans == 0) return report;
    speed_changes(window, options, report.changes);
    ambient_jumps(window, ambient, options, report.changes);
    for (const RegimeChange& change : report.changes) {
        if (change.restarts_window) report.usable_from_s = std::max(report.usable_from_s, change.time_s);
    }
    if (options.search_unexplained) {
        TestWindow rest = without_spikes(window_from(window, report.usable_from_s));
        for (int round = 0; round < 6; ++round) {
            const std::vector<RegimeChange> found = unexplained_changes(rest, ambient, options);
            if (found.empty()) break;
            for (const RegimeChange& change : found) {
                report.changes.push_back(change);
                report.usable_from_s = std::max(report.usable_from_s, change.time_s);
            }
            rest = window_from(rest, report.usable_from_s);
        }
    }
    std::sort(report.changes.begin(), report.changes.end(),
              [](const RegimeChange& a, const RegimeChange& b) { return a.time_s < b.time_s; });
    if (!report.changes.empty()) report.last_change_s = report.changes.back().time_s;
    return report;
}

}  // namespace thermbal
