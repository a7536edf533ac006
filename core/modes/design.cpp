#include "design.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include <Eigen/Eigenvalues>

#include "base/median.hpp"
#include "base/units.hpp"
#include "series/resolution.hpp"
#include "series/sample.hpp"
#include "unrounded_room.hpp"

namespace thermbal {

namespace {

constexpr double reference_minutes = 3.0;

void bridge_gaps(std::vector<double>& values) {
    std::size_t last_good = values.size();
    for (std::size_t k = 0; k < values.size(); ++k) {
        if (std::isnan(values[k])) continue;
        const double from = last_good == values.size() ? values[k] : values[last_good];
        const std::size_t begin = last_good == values.size() ? 0 : last_good + 1;
        for (std::size_t gap = begin; gap < k; ++gap) {
            const double share = static_cast<double>(gap + 1 - begin) / static_cast<double>(k + 1 - begin);
            values[gap] = from + share * (values[k] - from);
        }
        last_good = k;
    }
    if (last_good == values.size()) return;
    for (std::size_t k = last_good + 1; k < values.size(); ++k) values[k] = values[last_good];
}

/// Exact response of tau dx/dt = u - x to an input that is linear between scans, from x = 0.
std::vector<double> lagged(const std::vector<double>& input, double period_min, double tau_min) {
    const double ratio = period_min / tau_min;
    const double decay = std::exp(-ratio);
    const double of_old = (1.0 - decay) / ratio - decay;
    const double of_new = 1.0 - (1.0 - decay) / ratio;
    std::vector<double> output(input.size(), 0.0);
    for (std::size_t k = 1; k < input.size(); ++k) {
        output[k] = decay * output[k - 1] + of_old * input[k - 1] + of_new * input[k];
    }
    return output;
}

void reject_spikes(std::vector<double>& values) {
    constexpr std::size_t reach = 4;
    constexpr double sigmas = 5.0;
    constexpr double sigma_per_mad = 1.4826;
    std::vector<double> deviation(values.size(), 0.0);
    std::vector<double> local_scatter(values.size(), 0.0);
    std::vector<double> all;
    std::vector<double> near;
    for (std::size_t k = 0; k < values.size(); ++k) {
        if (std::isnan(values[k])) continue;
        near.clear();
        const std::size_t last = std::min(values.size(), k + reach + 1);
        for (std::size_t other = k < reach ? 0 : k - reach; other < last; ++other) {
            if (!std::isnan(values[other])) near.push_back(values[other]);
        }
        const double centre = upper_median(near);
        deviation[k] = std::abs(values[k] - centre);
        for (double& value : near) value = std::abs(value - centre);
        local_scatter[k] = upper_median(near);
        all.push_back(deviation[k]);
    }
    if (all.empty()) return;
    const double typical = std::max(sigma_per_mad * upper_median(all), 0.3 * smallest_step(values));
    for (std::size_t k = 0; k < values.size(); ++k) {
        const double scatter = std::max(typical, sigma_per_mad * local_scatter[k]);
        if (!std::isnan(values[k]) && deviation[k] > sigmas * scatter) values[k] = std::nan("");
    }
}

struct Decomposition {
    Eigen::MatrixXd weighted;  // sqrt(count) * design
    Eigen::MatrixXd eigenvectors;
    Eigen::VectorXd eigenvalues;  // those that carry information
    Eigen::MatrixXd fine;         // the fine columns in the rotated frame
};

/// Gram matrices lose half the digits; what is lost lies far below what samples of 0.01 C can tell.
Decomposition decompose(const Eigen::MatrixXd& design, const Eigen::MatrixXd& fine,
                        const Eigen::VectorXd& count) {
    constexpr double negligible = 1e-12;
    Decomposition result;
    result.weighted = count.cwiseSqrt().asDiagonal() * design;
    const Eigen::MatrixXd gram = result.weighted.transpose() * result.weighted;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
    const Eigen::VectorXd& all = solver.eigenvalues();
    const double largest = all[all.size() - 1];
    Eigen::Index kept = 0;
    while (kept < all.size() && all[all.size() - 1 - kept] > negligible * largest) ++kept;
    result.eigenvalues = all.tail(kept);
    result.eigenvectors = solver.eigenvectors().rightCols(kept);
    const Eigen::MatrixXd weighted_fine = count.cwiseSqrt().asDiagonal() * fine;
    result.fine = result.eigenvalues.cwiseSqrt().cwiseInverse().asDiagonal() *
                  (result.eigenvectors.transpose() * (result.weighted.transpose() * weighted_fine));
    return result;
}

/// Geyer's initial positive sequence (1992): sums pairs of autocorrelations while they are positive.
double integrated_autocorrelation(const Eigen::VectorXd& residual) {
    const Eigen::Index count = residual.size();
    const double variance = residual.squaredNorm();
    if (count < 16 || variance <= 0.0) return 1.0;
    double sum = 1.0;
    for (Eigen::Index lag = 1; lag + 1 < count / 3; lag += 2) {
        const double first = residual.head(count - lag).dot(residual.tail(count - lag)) / variance;
        const double second = residual.head(count - lag - 1).dot(residual.tail(count - lag - 1)) / variance;
        if (first + second <= 0.0) break;
        sum += 2.0 * (first + second);
    }
    return std::max(1.0, sum);
}

}  // namespace

BlockMeans block_means(const std::vector<double>& values, Eigen::Index rows, std::size_t scans_per_block) {
    BlockMeans blocks;
    const double centre = mean_of_good(values);
    blocks.centre_C = std::isnan(centre) ? 0.0 : centre;
    blocks.mean = Eigen::VectorXd::Zero(rows);
    blocks.count = Eigen::VectorXd::Zero(rows);
    for (Eigen::Index row = 0; row < rows; ++row) {
        const std::size_t first = static_cast<std::size_t>(row) * scans_per_block;
        const std::size_t last = std::min(first + scans_per_block, values.size());
        double sum = 0.0;
        double square = 0.0;
        double count = 0.0;
        for (std::size_t k = first; k < last; ++k) {
            if (std::isnan(values[k])) continue;
            const double deviation = values[k] - blocks.centre_C;
            sum += deviation;
            square += deviation * deviation;
            count += 1.0;
        }
        blocks.count[row] = count;
        if (count == 0.0) continue;
        blocks.mean[row] = sum / count;
        blocks.within_sum += square - sum * sum / count;
        blocks.good += static_cast<std::size_t>(count);
    }
    return blocks;
}

TestWindow without_spikes(const TestWindow& window) {
    TestWindow clean = window;
    for (Column& column : clean.channels) reject_spikes(column.values);
    return clean;
}

double AmbientInput::range_C() const {
    if (deviation_C.empty()) return 0.0;
    std::vector<double> sorted = deviation_C;
    std::sort(sorted.begin(), sorted.end());
    const auto at = [&](double share) {
        return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
    };
    return at(0.98) - at(0.02);
}

AmbientInput ambient_input(const TestWindow& window, std::string_view ambient, double tail_min) {
    AmbientInput input;
    const Column* column = ambient.empty() ? nullptr : window.channel(ambient);
    if (column == nullptr || window.scans == 0) return input;
    const auto scans_in = [&](double minutes) {
        const auto count = static_cast<std::size_t>(std::lround(minutes * seconds_per_min / window.period_s));
        return std::clamp<std::size_t>(count, 1, window.scans);
    };
    if (std::isnan(mean_of_good(column->values))) return input;
    std::vector<double> values = unrounded_room(column->values, window.period_s).value_or(column->values);
    bridge_gaps(values);
    input.measured = true;
    input.reference_C = mean_of_good(std::span(values).first(scans_in(reference_minutes)));
    input.tail_C = mean_of_good(std::span(values).last(scans_in(tail_min)));
    input.deviation_C.reserve(values.size());
    for (const double value : values) input.deviation_C.push_back(value - input.reference_C);
    return input;
}

std::vector<double> logarithmic_grid(double first, double last, std::size_t points) {
    std::vector<double> grid(points);
    for (std::size_t k = 0; k < points; ++k) {
        grid[k] = first * std::pow(last / first, static_cast<double>(k) / static_cast<double>(points - 1));
    }
    return grid;
}

Eigen::MatrixXd block_design(const Basis& basis, const TestWindow& window, const AmbientInput& ambient,
                             std::size_t scans_per_block) {
    const auto rows = static_cast<Eigen::Index>((window.scans + scans_per_block - 1) / scans_per_block);
    const double period_min = window.period_s / seconds_per_min;
    Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, basis.size());
    design.col(0).setOnes();
    Eigen::VectorXd count = Eigen::VectorXd::Zero(rows);
    for (std::size_t k = 0; k < window.scans; ++k)
        count[static_cast<Eigen::Index>(k / scans_per_block)] += 1.0;
    for (Eigen::Index j = 0; j < basis.grid(); ++j) {
        const double tau = basis.time_constant_min[static_cast<std::size_t>(j)];
        const std::vector<double> room =
            basis.has_ambient ? lagged(ambient.deviation_C, period_min, tau) : std::vector<double>{};
        for (std::size_t k = 0; k < window.scans; ++k) {
            const auto row = static_cast<Eigen::Index>(k / scans_per_block);
            design(row, 1 + j) += -std::expm1(-static_cast<double>(k) * period_min / tau);
            if (basis.has_ambient) design(row, 1 + basis.grid() + j) += room[k];
        }
    }
    for (Eigen::Index row = 0; row < rows; ++row) {
        design.row(row).tail(basis.size() - 1) /= count[row];
    }
    return design;
}

Eigen::MatrixXd block_steps(const std::vector<double>& time_constant_min, const TestWindow& window,
                            std::size_t scans_per_block) {
    Basis basis;
    basis.time_constant_min = time_constant_min;
    return block_design(basis, window, AmbientInput{}, scans_per_block).rightCols(basis.grid());
}

Eigen::MatrixXd future_design(const Basis& basis, const TestWindow& window, const AmbientInput& ambient,
                              const std::vector<double>& after_min) {
    const auto rows = static_cast<Eigen::Index>(after_min.size());
    const double period_min = window.period_s / seconds_per_min;
    const double span_min = static_cast<double>(window.scans - 1) * period_min;
    Eigen::MatrixXd design(rows, basis.size());
    design.col(0).setOnes();
    for (Eigen::Index j = 0; j < basis.grid(); ++j) {
        const double tau = basis.time_constant_min[static_cast<std::size_t>(j)];
        const double room = basis.has_ambient ? lagged(ambient.deviation_C, period_min, tau).back() : 0.0;
        const double settled = ambient.tail_C - ambient.reference_C;
        for (Eigen::Index row = 0; row < rows; ++row) {
            const double after = after_min[static_cast<std::size_t>(row)];
            design(row, 1 + j) = -std::expm1(-(span_min + after) / tau);
            if (basis.has_ambient) {
                design(row, 1 + basis.grid() + j) = settled + (room - settled) * std::exp(-after / tau);
            }
        }
    }
    return design;
}

std::vector<ReducedChannel> reduce_channels(const Eigen::MatrixXd& design, const Eigen::MatrixXd& fine,
                                            const TestWindow& window,
                                            const std::vector<std::size_t>& channels,
                                            std::size_t scans_per_block) {
    std::vector<ReducedChannel> result(channels.size());
    Decomposition shared;
    Eigen::VectorXd shared_count;
    for (std::size_t i = 0; i < channels.size(); ++i) {
        const std::vector<double>& values = window.channels[channels[i]].values;
        const BlockMeans blocks = block_means(values, design.rows(), scans_per_block);
        ReducedChannel& channel = result[i];
        channel.good_samples = blocks.good;
        channel.centre_C = blocks.centre_C;
        channel.resolution_C = smallest_step(values);
        if (blocks.good == 0) continue;
        if (shared_count.size() != blocks.count.size() || shared_count != blocks.count) {
            shared = decompose(design, fine, blocks.count);
            shared_count = blocks.count;
        }
        const Eigen::VectorXd weighted = blocks.count.cwiseSqrt().cwiseProduct(blocks.mean);
        const Eigen::VectorXd root = shared.eigenvalues.cwiseSqrt();
        channel.reduced_fine = shared.fine;
        channel.reduced = root.asDiagonal() * shared.eigenvectors.transpose();
        channel.rotated = root.cwiseInverse().asDiagonal() *
                          (shared.eigenvectors.transpose() * (shared.weighted.transpose() * weighted));
        const Eigen::VectorXd residual =
            weighted -
            shared.weighted * (shared.eigenvectors * root.cwiseInverse().asDiagonal() * channel.rotated);
        const auto rows_used = static_cast<double>((blocks.count.array() > 0.0).count());
        const double freedom = std::max(1.0, rows_used - static_cast<double>(root.size()));
        const double between = residual.squaredNorm();
        const double within_freedom = static_cast<double>(blocks.good) - rows_used;
        // One sample's variance: what blocks scatter about the fit and samples within their block.
        const double pooled = (between + blocks.within_sum) / std::max(1.0, freedom + within_freedom);
        const double rounding = channel.resolution_C * channel.resolution_C / 12.0;
        const double floor = std::max(rounding, 1e-6);
        channel.sample_variance = std::max(pooled, floor);
        const double block_excess = std::max(1.0, between / freedom / channel.sample_variance);
        channel.variance_inflation = block_excess * integrated_autocorrelation(residual);
        channel.residual_rms_C = std::sqrt(between / std::max(1.0, static_cast<double>(blocks.good)));
        const Eigen::Index few = std::min<Eigen::Index>(3, blocks.mean.size());
        channel.change_C = blocks.mean.tail(few).mean() - blocks.mean.head(few).mean();
        channel.range_C = blocks.mean.maxCoeff() - blocks.mean.minCoeff();
    }
    return result;
}

}  // namespace thermbal
