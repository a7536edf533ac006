#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "base/error.hpp"

namespace thermbal {

/// The recursive alternative of Xia et al. 2014 (doi 10.1631/jzus.A1400074): an adaptive unscented Kalman
/// filter. The time constants are a machine tool's, a fast and a slow one; both are known beforehand to their
/// `log_..._sd` and forget what they have learnt over `memory_min`, which keeps the interval honest while
/// more modes than two die away.
struct KalmanOptions {
    double period_s = 15.0;
    double fast_time_constant_min = 10.0;
    double log_fast_sd = 0.6;
    double slow_time_constant_min = 55.0;
    double log_slow_sd = 0.35;
    double memory_min = 60.0;
    double fast_slope_sd_C_per_min = 0.5;
    double slow_slope_sd_C_per_min = 0.2;
    double measurement_sd_C = 0.06;   ///< start value; adapts
    double slope_walk_share = 0.002;  ///< process noise a step, of each slope
    double forgetting = 0.99;         ///< of the adaptive noise estimate (Sage and Husa 1969), per sample
    double spike_sds = 8.0;           ///< an innovation beyond this many of its own deviations is a spike ...
    int spikes_in_a_row = 4;  ///< ... unless this many follow each other: the channel has moved, begin anew

    Result<void> check() const;
};

/// One channel. State: temperature T, and of a fast and a slow exponential the slope D and the logarithm of
/// the time constant tau, which early samples see almost linearly; the equilibrium is E = T + D_f tau_f + D_s
/// tau_s (with E itself as a state the filter locks on to early noise):
///     T' = T + sum D tau (1 - exp(-dt/tau)),   D' = D exp(-dt/tau),   y = T + noise,
/// the log tau an Ornstein-Uhlenbeck process about what is known beforehand. O(1) memory and work a sample.
/// Symmetric sigma points (Julier and Uhlmann 1997); the measurement noise adapts to the innovations. With
/// one exponential alone the start of a distant sensor, which bends upwards, is taken for a time constant of
/// hours. How often its interval holds: README.
class AdaptiveUnscentedKalman {
  public:
    explicit AdaptiveUnscentedKalman(const KalmanOptions& options) : options_(options) {}

    /// One scan; NaN is a missing sample: the state is propagated and nothing is learnt.
    void add(double temperature_C);

    bool started() const { return started_; }
    double temperature_C() const { return state_[0]; }
    double steady_state_C() const { return settled().mean_C; }
    double steady_state_sd_C() const { return settled().sd_C; }
    double slow_time_constant_min() const;
    double measurement_sd_C() const;
    /// Since the first scan that was added: when 95 % of the way from it to the steady state is done; the
    /// past if it is over.
    double equilibrium_time_min() const;
    std::size_t samples() const { return samples_; }

  private:
    static constexpr std::size_t size = 5;
    using State = std::array<double, size>;
    using Covariance = std::array<std::array<double, size>, size>;

    struct Settled {
        double mean_C;
        double sd_C;
    };
    Settled settled() const;  ///< the unscented transform of E
    std::array<State, 2 * size> sigma_points() const;
    void start(double temperature_C);
    static void clamp_time_constants(State& state);
    State moved(State state) const;
    void add_process_noise();
    void predict();
    bool is_far(double temperature_C);  ///< and counts how many were in a row
    void update(double temperature_C);

    KalmanOptions options_;
    bool started_ = false;
    std::size_t scans_ = 0;
    std::size_t samples_ = 0;
    int spikes_ = 0;  ///< in a row
    double first_C_ = 0.0;
    double noise_variance_ = 0.0;
    State state_{};
    Covariance covariance_{};
};

/// The filter after the scans of a window, oldest first.
AdaptiveUnscentedKalman kalman_after(std::span<const double> samples_C, const KalmanOptions& options);

}  // namespace thermbal
