#include "modes/kalman.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace thermbal {

namespace {

constexpr double seconds_per_min = 60.0;
constexpr double fastest_log_min = -0.7;  // 0.5 min
constexpr double slowest_log_min = 6.7;   // 810 min
constexpr double least_variance = 1e-12;

template <typename Covariance>
Covariance lower_factor(const Covariance& matrix) {
    Covariance factor{};
    for (std::size_t row = 0; row < matrix.size(); ++row) {
        for (std::size_t column = 0; column <= row; ++column) {
            double value = matrix[row][column];
            for (std::size_t k = 0; k < column; ++k) value -= factor[row][k] * factor[column][k];
            factor[row][column] =
                row == column ? std::sqrt(std::max(value, least_variance)) : value / factor[column][column];
        }
    }
    return factor;
}

}  // namespace

Result<void> KalmanOptions::check() const {
    const auto refuse = [](std::string_view field, double found) {
        return fail(NextStep::refuse_input, fmt::format("{} is {}, accepted is above 0", field, found));
    };
    if (!(period_s > 0.0)) return refuse("period_s", period_s);
    if (!(initial_time_constant_min > 0.0))
        return refuse("initial_time_constant_min", initial_time_constant_min);
    if (!(measurement_sd_C > 0.0)) return refuse("measurement_sd_C", measurement_sd_C);
    const bool fades = forgetting > 0.0 && forgetting < 1.0;
    if (!fades) {
        return fail(NextStep::refuse_input,
                    fmt::format("forgetting is {}, accepted is between 0 and 1", forgetting));
    }
    return {};
}

void AdaptiveUnscentedKalman::add(double temperature_C) {
    if (started_) {
        ++scans_;
        predict();
        if (!std::isnan(temperature_C) && !is_spike(temperature_C)) update(temperature_C);
    } else if (std::isnan(temperature_C)) {
        ++scans_;
    } else {
        start(temperature_C);
    }
}

bool AdaptiveUnscentedKalman::is_spike(double temperature_C) {
    const double innovation = temperature_C - state_[0];
    const double expected = covariance_[0][0] + noise_variance_;
    const bool far = innovation * innovation > options_.spike_sds * options_.spike_sds * expected;
    spikes_ = far ? spikes_ + 1 : 0;
    return far && spikes_ < options_.spikes_in_a_row;
}

void AdaptiveUnscentedKalman::start(double temperature_C) {
    const auto square = [](double value) { return value * value; };
    started_ = true;
    samples_ = 1;
    first_C_ = temperature_C;
    noise_variance_ = square(options_.measurement_sd_C);
    state_ = {temperature_C, 0.0, std::log(options_.initial_time_constant_min)};
    covariance_ = {};
    covariance_[0][0] = noise_variance_;
    covariance_[1][1] = square(options_.initial_slope_sd_C_per_min);
    covariance_[2][2] = square(options_.initial_log_time_constant_sd);
}

std::array<AdaptiveUnscentedKalman::State, 2 * AdaptiveUnscentedKalman::size>
AdaptiveUnscentedKalman::sigma_points() const {
    const Covariance factor = lower_factor(covariance_);
    const double spread = std::sqrt(static_cast<double>(size));
    std::array<State, 2 * size> points;
    for (std::size_t point = 0; point < points.size(); ++point) {
        points[point] = state_;
        const double sign = point < size ? spread : -spread;
        for (std::size_t row = 0; row < size; ++row) points[point][row] += sign * factor[row][point % size];
        points[point][2] = std::clamp(points[point][2], fastest_log_min, slowest_log_min);
    }
    return points;
}

AdaptiveUnscentedKalman::Settled AdaptiveUnscentedKalman::settled() const {
    double sum = 0.0;
    double square = 0.0;
    const auto points = sigma_points();
    const double centre = state_[0] + state_[1] * std::exp(state_[2]);
    for (const State& point : points) {
        const double value = point[0] + point[1] * std::exp(point[2]) - centre;
        sum += value / static_cast<double>(points.size());
        square += value * value / static_cast<double>(points.size());
    }
    return {centre + sum, std::sqrt(std::max(0.0, square - sum * sum))};
}

void AdaptiveUnscentedKalman::predict() {
    std::array<State, 2 * size> moved = sigma_points();
    const double period_min = options_.period_s / seconds_per_min;
    const auto points = static_cast<double>(moved.size());
    State mean{};
    for (State& sigma : moved) {
        const double tau = std::exp(sigma[2]);
        const double decay = std::exp(-period_min / tau);
        sigma[0] += sigma[1] * tau * (1.0 - decay);
        sigma[1] *= decay;
        for (std::size_t row = 0; row < size; ++row) mean[row] += sigma[row] / points;
    }
    covariance_ = {};
    for (const State& sigma : moved) {
        for (std::size_t row = 0; row < size; ++row) {
            for (std::size_t column = 0; column < size; ++column) {
                covariance_[row][column] +=
                    (sigma[row] - mean[row]) * (sigma[column] - mean[column]) / points;
            }
        }
    }
    const double slope_walk = options_.slope_walk_share * mean[1];
    covariance_[1][1] += slope_walk * slope_walk;
    covariance_[2][2] += options_.log_time_constant_walk * options_.log_time_constant_walk;
    state_ = mean;
}

void AdaptiveUnscentedKalman::update(double temperature_C) {
    const double innovation = temperature_C - state_[0];
    const double predicted = covariance_[0][0];
    // Sage and Husa: the innovations' second moment less what the state explains is the sensor's noise.
    const double fading = (1.0 - options_.forgetting) /
                          (1.0 - std::pow(options_.forgetting, static_cast<double>(samples_ + 1)));
    const double floor = 0.01 * options_.measurement_sd_C * options_.measurement_sd_C;
    noise_variance_ = std::max(floor, (1.0 - fading) * noise_variance_ +
                                          fading * std::max(0.0, innovation * innovation - predicted));
    const double total = predicted + noise_variance_;
    State gain;
    for (std::size_t row = 0; row < size; ++row) gain[row] = covariance_[row][0] / total;
    const std::array<double, size> first_row = covariance_[0];
    for (std::size_t row = 0; row < size; ++row) {
        state_[row] += gain[row] * innovation;
        for (std::size_t column = 0; column < size; ++column) {
            covariance_[row][column] -= gain[row] * first_row[column];
        }
    }
    for (std::size_t row = 0; row < size; ++row) {
        for (std::size_t column = 0; column < row; ++column) {
            const double value = 0.5 * (covariance_[row][column] + covariance_[column][row]);
            covariance_[row][column] = value;
            covariance_[column][row] = value;
        }
        covariance_[row][row] = std::max(covariance_[row][row], least_variance);
    }
    state_[2] = std::clamp(state_[2], fastest_log_min, slowest_log_min);
    ++samples_;
}

double AdaptiveUnscentedKalman::time_constant_min() const {
    return std::exp(state_[2]);
}

double AdaptiveUnscentedKalman::measurement_sd_C() const {
    return std::sqrt(noise_variance_);
}

double AdaptiveUnscentedKalman::equilibrium_time_min() const {
    const double now_min = static_cast<double>(scans_) * options_.period_s / seconds_per_min;
    const double steady_state = steady_state_C();
    const double rise = steady_state - first_C_;
    const double left = steady_state - state_[0];
    if (rise == 0.0 || left / rise <= 0.05) return now_min;
    return now_min + time_constant_min() * std::log(left / (0.05 * rise));
}

AdaptiveUnscentedKalman kalman_after(std::span<const double> samples_C, const KalmanOptions& options) {
    AdaptiveUnscentedKalman filter(options);
    for (const double sample_C : samples_C) filter.add(sample_C);
    return filter;
}

}  // namespace thermbal
