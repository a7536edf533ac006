#include "modes/information_limit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <fmt/format.h>

#include "base/units.hpp"
#include "design.hpp"
#include "series/resolution.hpp"

namespace thermbal {

namespace {

constexpr double two_sided_90 = 1.6448536269514722;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Linear columns at block times for given time constants, and their derivatives by log tau.
struct Columns {
    Eigen::MatrixXd linear;
    Eigen::MatrixXd step_slope;  // of the step columns
    Eigen::MatrixXd room_slope;  // of the ambient columns, empty without
};

struct Series {
    std::vector<std::string> names;
    Eigen::MatrixXd values;   // blocks x channels, centred
    Eigen::MatrixXd present;  // 1 or 0
    Eigen::VectorXd centre;
    Eigen::VectorXd sigma;  // of a block mean
    Eigen::VectorXd sample_sigma;
};

Columns columns_at(const TestWindow& window, const AmbientInput& room, const Eigen::VectorXd& log_tau,
                   std::size_t per_block) {
    constexpr double step = 1e-4;
    const auto design_of = [&](const Eigen::VectorXd& logs) {
        Basis basis;
        basis.has_ambient = room.measured;
        for (const double value : logs) basis.time_constant_min.push_back(std::exp(value));
        return block_design(basis, window, room, per_block);
    };
    Columns columns;
    columns.linear = design_of(log_tau);
    const Eigen::MatrixXd moved = design_of(log_tau.array() + step);
    const Eigen::MatrixXd slope = (moved - columns.linear) / step;
    columns.step_slope = slope.middleCols(1, log_tau.size());
    if (room.measured) columns.room_slope = slope.rightCols(log_tau.size());
    return columns;
}

struct Fit {
    double cost = infinity;
    Eigen::MatrixXd normal;  // of log tau
    Eigen::VectorXd gradient;
    Eigen::MatrixXd coefficients;  // basis x channels
};

/// Cost, gradient and Gauss-Newton matrix in log tau with the linear coefficients eliminated.
Fit evaluate(const Series& series, const Columns& columns) {
    const Eigen::Index modes = columns.step_slope.cols();
    Fit fit;
    fit.cost = 0.0;
    fit.normal = Eigen::MatrixXd::Zero(modes, modes);
    fit.gradient = Eigen::VectorXd::Zero(modes);
    fit.coefficients.resize(columns.linear.cols(), series.values.cols());
    for (Eigen::Index i = 0; i < series.values.cols(); ++i) {
        const auto present = series.present.col(i).asDiagonal();
        const Eigen::MatrixXd linear = present * columns.linear;
        const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(linear);
        const Eigen::VectorXd coefficient = qr.solve(series.values.col(i));
        fit.coefficients.col(i) = coefficient;
        const Eigen::VectorXd residual = series.values.col(i) - linear * coefficient;
        Eigen::MatrixXd slope = columns.step_slope * coefficient.segment(1, modes).asDiagonal();
        if (columns.room_slope.size() > 0) slope += columns.room_slope * coefficient.tail(modes).asDiagonal();
        slope = present * slope;
        const Eigen::MatrixXd free = slope - linear * qr.solve(slope);
        const double precision = 1.0 / (series.sigma[i] * series.sigma[i]);
        fit.cost += precision * residual.squaredNorm();
        fit.gradient += precision * free.transpose() * residual;
        fit.normal += precision * free.transpose() * free;
    }
    return fit;
}

/// Of one sample, from second differences: a steep start is no noise. 0 with too few samples in a row.
double sample_variance(const std::vector<double>& values) {
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t k = 2; k < values.size(); ++k) {
        const double bend = values[k] - 2.0 * values[k - 1] + values[k - 2];
        if (std::isnan(bend)) continue;
        sum += bend * bend;
        ++count;
    }
    return count == 0 ? 0.0 : sum / (6.0 * static_cast<double>(count));
}

Result<Series> structural_series(const TestWindow& window, std::string_view ambient, std::size_t per_block) {
    const auto rows = static_cast<Eigen::Index>((window.scans + per_block - 1) / per_block);
    std::vector<const Column*> columns;
    for (const Column& column : window.channels) {
        const bool any =
            std::any_of(column.values.begin(), column.values.end(), [](double v) { return !std::isnan(v); });
        if (column.name != ambient && any) columns.push_back(&column);
    }
    if (columns.empty())
        return fail(NextStep::refuse_input, "the recording has no structural channel with samples");
    const auto count = static_cast<Eigen::Index>(columns.size());
    Series series;
    series.values = Eigen::MatrixXd::Zero(rows, count);
    series.present = Eigen::MatrixXd::Zero(rows, count);
    series.centre = Eigen::VectorXd::Zero(count);
    series.sigma.resize(count);
    series.sample_sigma.resize(count);
    for (Eigen::Index i = 0; i < count; ++i) {
        const Column& column = *columns[static_cast<std::size_t>(i)];
        series.names.push_back(column.name);
        const BlockMeans blocks = block_means(column.values, rows, per_block);
        series.centre[i] = blocks.centre_C;
        series.values.col(i) = blocks.mean;
        series.present.col(i) = (blocks.count.array() > 0.0).cast<double>();
        const double variance = sample_variance(column.values);
        const double rounding = std::pow(smallest_step(column.values), 2) / 12.0;
        series.sample_sigma[i] = std::sqrt(std::max({variance, rounding, 1e-6}));
        series.sigma[i] = series.sample_sigma[i] / std::sqrt(static_cast<double>(per_block));
    }
    return series;
}

Eigen::VectorXd spread_over(double first, double last, std::size_t modes) {
    Eigen::VectorXd logs(static_cast<Eigen::Index>(modes));
    for (Eigen::Index k = 0; k < logs.size(); ++k) {
        const double share = (static_cast<double>(k) + 0.5) / static_cast<double>(modes);
        logs[k] = std::log(first) + share * std::log(last / first);
    }
    return logs;
}

struct Solved {
    Eigen::VectorXd log_tau;
    Fit fit;
};

Solved levenberg_marquardt(const TestWindow& window, const AmbientInput& room, const Series& series,
                           std::size_t per_block, const Eigen::VectorXd& log_tau) {
    constexpr double fastest = -1.0;  // exp: 0.37 min
    constexpr double slowest = 7.3;   // exp: 1480 min
    Solved best{log_tau, evaluate(series, columns_at(window, room, log_tau, per_block))};
    double damping = 1e-2;
    for (int iteration = 0; iteration < 60 && damping < 1e8; ++iteration) {
        Eigen::MatrixXd normal = best.fit.normal;
        normal.diagonal() *= 1.0 + damping;
        normal.diagonal().array() += 1e-9;
        Eigen::VectorXd step = normal.ldlt().solve(best.fit.gradient);
        step = step.cwiseMax(-0.5).cwiseMin(0.5);
        const Eigen::VectorXd trial = (best.log_tau + step).cwiseMax(fastest).cwiseMin(slowest);
        Fit fit = evaluate(series, columns_at(window, room, trial, per_block));
        if (!(fit.cost < best.fit.cost)) {
            damping *= 4.0;
            continue;
        }
        const bool converged = best.fit.cost - fit.cost < 1e-6 * best.fit.cost;
        best = {trial, std::move(fit)};
        damping = std::max(1e-9, damping / 5.0);
        if (converged) break;
    }
    return best;
}

Eigen::MatrixXd step_columns(const std::vector<double>& tau, double period_min, Eigen::Index samples) {
    Eigen::MatrixXd columns(samples, 1 + static_cast<Eigen::Index>(tau.size()));
    columns.col(0).setOnes();
    for (Eigen::Index k = 0; k < samples; ++k) {
        for (std::size_t j = 0; j < tau.size(); ++j) {
            columns(k, 1 + static_cast<Eigen::Index>(j)) =
                -std::expm1(-static_cast<double>(k) * period_min / tau[j]);
        }
    }
    return columns;
}

Eigen::MatrixXd step_derivatives(const std::vector<double>& tau, double period_min, Eigen::Index samples) {
    Eigen::MatrixXd columns(samples, static_cast<Eigen::Index>(tau.size()));
    for (Eigen::Index k = 0; k < samples; ++k) {
        for (std::size_t j = 0; j < tau.size(); ++j) {
            const double ratio = static_cast<double>(k) * period_min / tau[j];
            columns(k, static_cast<Eigen::Index>(j)) = -ratio * std::exp(-ratio);
        }
    }
    return columns;
}

}  // namespace

Result<SharedModes> fit_shared_modes(const TestWindow& window, std::string_view ambient, std::size_t modes) {
    if (!ambient.empty() && window.channel(ambient) == nullptr) {
        return fail(NextStep::refuse_input,
                    fmt::format("the ambient channel {} is not in the recording; name one that is, or none",
                                ambient));
    }
    const auto per_block = std::max<std::size_t>(
        1, static_cast<std::size_t>(std::lround(seconds_per_min / std::max(1e-3, window.period_s))));
    if (modes == 0 || window.scans < per_block * (4 * modes + 8)) {
        return fail(NextStep::refuse_input,
                    fmt::format("{} scans do not determine {} time constants", window.scans, modes));
    }
    const Result<Series> series = structural_series(window, ambient, per_block);
    if (!series) return std::unexpected(series.error());
    const AmbientInput room = ambient_input(window, ambient, 15.0);
    const double span_min = (window.end_s() - window.start_s) / seconds_per_min;
    Solved best;
    for (const double first : {2.0, 8.0, 20.0}) {
        Solved solved = levenberg_marquardt(window, room, *series, per_block,
                                            spread_over(first, std::max(60.0, span_min), modes));
        if (solved.fit.cost < best.fit.cost) best = std::move(solved);
    }
    std::vector<Eigen::Index> order(modes);
    for (std::size_t k = 0; k < modes; ++k) order[k] = static_cast<Eigen::Index>(k);
    std::sort(order.begin(), order.end(),
              [&](Eigen::Index a, Eigen::Index b) { return best.log_tau[a] < best.log_tau[b]; });
    SharedModes result;
    for (const Eigen::Index k : order) result.time_constant_min.push_back(std::exp(best.log_tau[k]));
    double weighted = 0.0;
    for (std::size_t i = 0; i < series->names.size(); ++i) {
        const auto column = static_cast<Eigen::Index>(i);
        SharedModes::Channel channel;
        channel.channel = series->names[i];
        channel.level_C = series->centre[column] + best.fit.coefficients(0, column);
        for (const Eigen::Index k : order)
            channel.amplitude_C.push_back(best.fit.coefficients(1 + k, column));
        channel.noise_C = series->sample_sigma[column];
        weighted += series->sigma[column] * series->sigma[column];
        result.channels.push_back(std::move(channel));
    }
    const double mean_variance = weighted / static_cast<double>(series->names.size());
    result.residual_rms_C = std::sqrt(best.fit.cost / std::max(1.0, series->present.sum()) * mean_variance);
    return result;
}

Result<SharedModes> fit_shared_modes_of_best_order(const TestWindow& window, std::string_view ambient,
                                                   std::size_t most) {
    Result<SharedModes> best = fit_shared_modes(window, ambient, 1);
    if (!best) return best;
    const auto criterion = [&](const SharedModes& fit) {
        const double rows = static_cast<double>(window.scans) * window.period_s / seconds_per_min;
        const double values = rows * static_cast<double>(fit.channels.size());
        const double unknowns = static_cast<double>(fit.time_constant_min.size() * (fit.channels.size() + 1));
        return values * 2.0 * std::log(fit.residual_rms_C) + unknowns * std::log(values);
    };
    for (std::size_t modes = 2; modes <= most; ++modes) {
        Result<SharedModes> next = fit_shared_modes(window, ambient, modes);
        if (!next || criterion(*next) >= criterion(*best)) break;
        best = std::move(next);
    }
    return best;
}

std::vector<double> steady_state_bound_C(const SharedModes& truth, double period_s, double until_min,
                                         SharedKnowledge knowledge, double relative_sd) {
    const double period_min = period_s / seconds_per_min;
    const auto samples = static_cast<Eigen::Index>(std::floor(until_min / period_min + 1e-9)) + 1;
    const auto modes = static_cast<Eigen::Index>(truth.time_constant_min.size());
    std::vector<double> bound(truth.channels.size(), infinity);
    if (samples < modes + 2) return bound;
    const Eigen::MatrixXd linear = step_columns(truth.time_constant_min, period_min, samples);
    const Eigen::MatrixXd slope = step_derivatives(truth.time_constant_min, period_min, samples);
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(linear);
    const Eigen::MatrixXd triangle = qr.matrixQR().topRows(linear.cols()).triangularView<Eigen::Upper>();
    const Eigen::VectorXd functional = Eigen::VectorXd::Ones(linear.cols());
    const Eigen::VectorXd half = triangle.transpose().triangularView<Eigen::Lower>().solve(functional);
    const Eigen::MatrixXd slope_on_linear = qr.solve(slope);
    const Eigen::MatrixXd free = slope - linear * slope_on_linear;
    const Eigen::MatrixXd free_normal = free.transpose() * free;

    const auto information_of = [&](const SharedModes::Channel& channel) {
        const Eigen::Map<const Eigen::VectorXd> amplitude(channel.amplitude_C.data(), modes);
        return Eigen::MatrixXd(amplitude.asDiagonal() * free_normal * amplitude.asDiagonal() /
                               (channel.noise_C * channel.noise_C));
    };
    Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(modes, modes);
    for (const SharedModes::Channel& channel : truth.channels) joint += information_of(channel);
    if (knowledge == SharedKnowledge::joint_with_prior)
        joint.diagonal().array() += 1.0 / (relative_sd * relative_sd);
    for (std::size_t i = 0; i < truth.channels.size(); ++i) {
        const SharedModes::Channel& channel = truth.channels[i];
        const Eigen::Map<const Eigen::VectorXd> amplitude(channel.amplitude_C.data(), modes);
        const Eigen::MatrixXd information =
            knowledge == SharedKnowledge::single_channel ? information_of(channel) : joint;
        const Eigen::LDLT<Eigen::MatrixXd> factor(information);
        const Eigen::VectorXd gain = amplitude.cwiseProduct(slope_on_linear.transpose() * functional);
        const double of_constants = gain.dot(factor.solve(gain));
        const double variance = channel.noise_C * channel.noise_C * half.squaredNorm() + of_constants;
        const bool determined = factor.info() == Eigen::Success && (factor.vectorD().array() > 0.0).all();
        if (determined && std::isfinite(variance) && variance > 0.0) bound[i] = std::sqrt(variance);
    }
    return bound;
}

std::vector<double> earliest_possible_min(const SharedModes& truth, double period_s, double tolerance_C,
                                          double latest_min, SharedKnowledge knowledge, double step_min,
                                          double relative_sd) {
    std::vector<double> earliest(truth.channels.size(), infinity);
    for (double until = step_min; until <= latest_min; until += step_min) {
        const std::vector<double> bound =
            steady_state_bound_C(truth, period_s, until, knowledge, relative_sd);
        bool open = false;
        for (std::size_t i = 0; i < bound.size(); ++i) {
            if (std::isinf(earliest[i]) && bound[i] * two_sided_90 <= tolerance_C) earliest[i] = until;
            open = open || std::isinf(earliest[i]);
        }
        if (!open) break;
    }
    return earliest;
}

}  // namespace thermbal
