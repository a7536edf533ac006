#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "base/error.hpp"

namespace thermbal {

/// The recursive alternative of Xia et al. 2014 (doi 10.1631/jzus.A1400074): an adaptive unscented Kalman
/// filter.
struct KalmanOptions {
    double period_s = 15.0;
    double initial_time_constant_min = 40.0;
    double initial_log_time_constant_sd = 0.8;
    double initial_slope_sd_C_per_min = 1.0;
    double measurement_sd_C = 0.06;         ///< start value; adapts
    double slope_walk_share = 0.002;        ///< process noise a step, of the slope: lets other modes in
    double log_time_constant_walk = 0.002;  ///< the rate slows as fast modes die away
    double forgetting = 0.99;  ///< of the adaptive noise estimate (Sage and Husa 1969), per sample
    double spike_sds = 8.0;    ///< an innovation beyond this many of its own deviations is a spike ...
    int spikes_in_a_row = 4;   ///< ... unless this many follow each other: then the channel has moved

    Result<void> check() const;
};

/// One channel. State: temperature T, slope D and logarithm of the time constant tau, which early samples see
/// almost linearly; the equilibrium is E = T + D tau (with E itself as a state the filter locks on to early
/// noise):
///     T' = T + D tau (1 - exp(-dt/tau)),   D' = D exp(-dt/tau),   log tau' = log tau,   y = T + noise.
/// O(1) memory and work a sample. Symmetric sigma points (Julier and Uhlmann 1997); the measurement noise
/// adapts to the innovations. Its interval is a single exponential's: see the README for how often it holds.
class AdaptiveUnscentedKalman {
  public:
    explicit AdaptiveUnscentedKalman(const KalmanOptions& options) : options_(options) {}

    /// One scan; NaN is a missing sample: the state is propagated and nothing is learnt.
    void add(double temperature_C);

    bool started() const { return started_; }
    double temperature_C() const { return state_[0]; }
    double steady_state_C() const { return settled().mean_C; }
    double steady_state_sd_C() const { return settled().sd_C; }
    double time_constant_min() const;
    double measurement_sd_C() const;
    /// Since the first scan that was added: when 95 % of the way from it to the steady state is done; the
    /// past if it is over.
    double equilibrium_time_min() const;
    std::size_t samples() const { return samples_; }

  private:
    static constexpr std::size_t size = 3;
    using State = std::array<double, size>;
    using Covariance = std::array<std::array<double, size>, size>;

    struct Settled {
        double mean_C;
        double sd_C;
    };
    Settled settled() const;  ///< the unscented transform of T + D tau
    std::array<State, 2 * size> sigma_points() const;
    void start(double temperature_C);
    void predict();
    bool is_spike(double temperature_C);
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
