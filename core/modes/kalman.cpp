#include "modes/kalman.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/units.hpp"

namespace thermbal {

namespace {

constexpr double fastest_log_min = -0.7;  // 0.5 min
constexpr double slowest_log_min = 6.7;   // 810 min
constexpr double least_variance = 1e-12;

// Where what stands in the state.
constexpr std::size_t temperature = 0;
struct Exponential {
    std::size_t slope;
    std::size_t log_time_constant;
};
constexpr Exponential fast{1, 2};
constexpr Exponential slow{3, 4};
constexpr std::array exponentials{fast, slow};

/// T + D_f tau_f + D_s tau_s.
template <typename State>
double equilibrium_C(const State& state) {
    double value_C = state[temperature];
    for (const auto& [slope, log_time_constant] : exponentials)
        value_C += state[slope] * std::exp(state[log_time_constant]);
    return value_C;
}

double squared(double value) {
    return value * value;
}

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
    struct Positive {
        std::string_view field;
        double found;
    };
    for (const auto& [field, found] :
         {Positive{"period_s", period_s}, Positive{"fast_time_constant_min", fast_time_constant_min},
          Positive{"slow_time_constant_min", slow_time_constant_min}, Positive{"memory_min", memory_min},
          Positive{"measurement_sd_C", measurement_sd_C}}) {
        if (!(found > 0.0))
            return fail(NextStep::refuse_input, fmt::format("{} is {}, accepted is above 0", field, found));
    }
    const bool fades = forgetting > 0.0 && forgetting < 1.0;
    if (!fades) {
        return fail(NextStep::refuse_input,
                    fmt::format("forgetting is {}, accepted is between 0 and 1", forgetting));
    }
    return {};
}

void AdaptiveUnscentedKalman::clamp_time_constants(State& state) {
    for (const auto& [slope, log_time_constant] : exponentials)
        state[log_time_constant] = std::clamp(state[log_time_constant], fastest_log_min, slowest_log_min);
}

void AdaptiveUnscentedKalman::add(double temperature_C) {
    if (started_) {
        ++scans_;
        predict();
        if (std::isnan(temperature_C)) return;
        if (!is_far(temperature_C)) {
            update(temperature_C);
        } else if (spikes_ == options_.spikes_in_a_row) {
            start(temperature_C);
        }
    } else if (std::isnan(temperature_C)) {
        ++scans_;
    } else {
        first_C_ = temperature_C;
        start(temperature_C);
    }
}

bool AdaptiveUnscentedKalman::is_far(double temperature_C) {
    const double innovation = temperature_C - state_[0];
    const double expected = covariance_[0][0] + noise_variance_;
    const bool far = innovation * innovation > options_.spike_sds * options_.spike_sds * expected;
    spikes_ = far ? spikes_ + 1 : 0;
    return far;
}

void AdaptiveUnscentedKalman::start(double temperature_C) {
    started_ = true;
    ++samples_;
    spikes_ = 0;
    noise_variance_ = squared(options_.measurement_sd_C);
    state_ = {temperature_C, 0.0, std::log(options_.fast_time_constant_min), 0.0,
              std::log(options_.slow_time_constant_min)};
    covariance_ = {};
    covariance_[temperature][temperature] = noise_variance_;
    const auto known_to = [&](std::size_t row, double sd) { covariance_[row][row] = squared(sd); };
    known_to(fast.slope, options_.fast_slope_sd_C_per_min);
    known_to(fast.log_time_constant, options_.log_fast_sd);
    known_to(slow.slope, options_.slow_slope_sd_C_per_min);
    known_to(slow.log_time_constant, options_.log_slow_sd);
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
        clamp_time_constants(points[point]);
    }
    return points;
}

AdaptiveUnscentedKalman::Settled AdaptiveUnscentedKalman::settled() const {
    double sum = 0.0;
    double square = 0.0;
    const auto points = sigma_points();
    const double centre = equilibrium_C(state_);
    for (const State& point : points) {
        const double value = equilibrium_C(point) - centre;
        sum += value / static_cast<double>(points.size());
        square += value * value / static_cast<double>(points.size());
    }
    return {centre + sum, std::sqrt(std::max(0.0, square - sum * sum))};
}

/// The state one sample later; the time constants go back a little towards what was known beforehand.
AdaptiveUnscentedKalman::State AdaptiveUnscentedKalman::moved(State state) const {
    const double period_min = options_.period_s / seconds_per_min;
    const double forgotten = -std::expm1(-period_min / options_.memory_min);
    for (const auto& [slope, log_time_constant] : exponentials) {
        const double tau = std::exp(state[log_time_constant]);
        state[temperature] -= state[slope] * tau * std::expm1(-period_min / tau);
        state[slope] *= std::exp(-period_min / tau);
    }
    const auto forget = [&](std::size_t row, double known_min) {
        state[row] += forgotten * (std::log(known_min) - state[row]);
    };
    forget(fast.log_time_constant, options_.fast_time_constant_min);
    forget(slow.log_time_constant, options_.slow_time_constant_min);
    return state;
}

void AdaptiveUnscentedKalman::add_process_noise() {
    const double period_min = options_.period_s / seconds_per_min;
    for (const auto& [slope, log_time_constant] : exponentials)
        covariance_[slope][slope] += squared(options_.slope_walk_share * state_[slope]);
    const double forgotten = -std::expm1(-2.0 * period_min / options_.memory_min);
    covariance_[fast.log_time_constant][fast.log_time_constant] += forgotten * squared(options_.log_fast_sd);
    covariance_[slow.log_time_constant][slow.log_time_constant] += forgotten * squared(options_.log_slow_sd);
}

void AdaptiveUnscentedKalman::predict() {
    std::array<State, 2 * size> points = sigma_points();
    const auto count = static_cast<double>(points.size());
    State mean{};
    for (State& point : points) {
        point = moved(point);
        for (std::size_t row = 0; row < size; ++row) mean[row] += point[row] / count;
    }
    covariance_ = {};
    for (const State& point : points) {
        for (std::size_t row = 0; row < size; ++row) {
            for (std::size_t column = 0; column < size; ++column) {
                covariance_[row][column] += (point[row] - mean[row]) * (point[column] - mean[column]) / count;
            }
        }
    }
    state_ = mean;
    add_process_noise();
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
    clamp_time_constants(state_);
    ++samples_;
}

double AdaptiveUnscentedKalman::slow_time_constant_min() const {
    return std::exp(state_[slow.log_time_constant]);
}

double AdaptiveUnscentedKalman::measurement_sd_C() const {
    return std::sqrt(noise_variance_);
}

double AdaptiveUnscentedKalman::equilibrium_time_min() const {
    const double now_min = static_cast<double>(scans_) * options_.period_s / seconds_per_min;
    const double steady_state = steady_state_C();
    const double rise = steady_state - first_C_;
    const auto left_after = [&](double minutes) {
        double left = 0.0;
        for (const auto& [slope, log_time_constant] : exponentials) {
            const double tau = std::exp(state_[log_time_constant]);
            left += state_[slope] * tau * std::exp(-minutes / tau);
        }
        return left;
    };
    const double latest_min = 10.0 * slow_time_constant_min();
    double minutes = 0.0;
    while (rise != 0.0 && left_after(minutes) / rise > 0.05 && minutes < latest_min) minutes += 0.5;
    return now_min + minutes;
}

AdaptiveUnscentedKalman kalman_after(std::span<const double> samples_C, const KalmanOptions& options) {
    AdaptiveUnscentedKalman filter(options);
    for (const double sample_C : samples_C) filter.add(sample_C);
    return filter;
}

}  // namespace thermbal
