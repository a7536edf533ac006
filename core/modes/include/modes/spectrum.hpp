#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// How the shared spectrum of time constants is estimated. Defaults hold for a machine tool's spindle head on
/// a 15 s grid; `check` names the field that is out of bounds.
struct SpectrumOptions {
    std::size_t time_constants = 28;  ///< points of the logarithmic grid
    double fastest_min = 1.5;         ///< first grid point
    double slowest_min = 600.0;       ///< last grid point
    double block_min = 1.0;           ///< samples are averaged over blocks of this length
    double falloff_min = 60.0;        ///< beyond this time constant less amplitude is expected ...
    double falloff_power = 1.5;       ///< ... as (falloff / tau)^power
    double weight_shape = 1.0;        ///< shape of the inverse-gamma prior of a weight
    double base_level = 0.003;        ///< prior mean of the level that weights without support fall back to
    double base_shape = 1.0;          ///< shape of the gamma prior of that level
    double scale_shape = 2.0;         ///< shape of the inverse-gamma prior of a channel's squared scale
    double scale_floor = 0.5;       ///< least expected scale, as a share of the median range of all channels
    double ambient_gain_sd = 0.05;  ///< how well the channel follows the room in the end: 1 +- this
    double ambient_centre_min = 60.0;  ///< median time constant of the response to the room, a priori
    double ambient_spread = 1.2;       ///< its spread, sd of log(tau)
    std::size_t burn_in = 60;          ///< Gibbs sweeps that are thrown away
    std::size_t draws = 240;           ///< Gibbs sweeps that are kept
    double interval_widening = 1.0;    ///< factor on every standard deviation of a steady state
    double ambient_tail_min = 15.0;    ///< the ambient stays at its mean over the last so many minutes

    Result<void> check() const;
};

/// What earlier tests of the same machine say about the spectrum: for every time constant of the grid the
/// mean of the logarithm of its weight and the spread of that logarithm between tests. See modes/archive.hpp.
struct SpectrumPrior {
    std::vector<double> time_constant_min;
    std::vector<double> log_weight_mean;
    std::vector<double> log_weight_sd;
    std::size_t tests = 0;
};

/// One channel as the spectrum sees it. Intervals are central 90 %.
struct ChannelEstimate {
    std::string channel;
    double start_C = 0.0;         ///< level at the start of the window, noise taken out
    double last_C = 0.0;          ///< level at its end
    double steady_state_C = 0.0;  ///< where it settles if the ambient stays at its mean over the last 15 min
    double steady_state_sd_C = 0.0;
    double steady_state_low_C = 0.0;
    double steady_state_high_C = 0.0;
    double equilibrium_time_min = 0.0;  ///< since the start of the test: 95 % of the whole rise
    double equilibrium_low_min = 0.0;
    double equilibrium_high_min = 0.0;
    double rise_C = 0.0;              ///< steady state less the level at the start of the test
    double noise_C = 0.0;             ///< standard deviation of one sample about the fit
    double resolution_C = 0.0;        ///< smallest step between readings
    double residual_rms_C = 0.0;      ///< of block means about the fit
    double variance_inflation = 1.0;  ///< integrated autocorrelation of the residuals, >= 1; 1 is white
    double slowest_time_constant_min =
        0.0;  ///< slowest that carries at least 5 % of this channel's amplitudes
    std::size_t good_samples = 0;
    std::vector<double>
        coefficients;  ///< posterior mean: level, step amplitudes, ambient amplitudes (see predict_curve)
};

struct SpectrumEstimate {
    std::vector<ChannelEstimate> channels;
    std::vector<double> time_constant_min;
    std::vector<double> weight;         ///< posterior geometric mean, relative to the channels' scale
    std::vector<double> log_weight_sd;  ///< its posterior spread
    double window_start_s = 0.0;
    double window_end_s = 0.0;
    double ambient_reference_C = 0.0;  ///< mean over the first minutes of the window; 0 without ambient
    double ambient_tail_C = 0.0;       ///< mean over the last 15 min; 0 without ambient
    bool has_ambient = false;
    double slowest_time_constant_min = 0.0;  ///< slowest that carries at least 5 % of all amplitudes
    std::size_t blocks = 0;                  ///< rows the fit saw
};

/// Estimates where every structural channel of `window` settles from one spectrum of time constants that all
/// of them share. With tau_j the grid, x_j(t) = 1 - exp(-t/tau_j) and u_j the ambient's deviation from its
/// start passed through a first-order lag tau_j, channel i is
///     y_i(t) = m_i + sum_j a_ij x_j(t) + sum_j b_ij u_j(t) + noise,   a_ij ~ N(0, s_i^2 w_j),  sum_j b_ij ~
///     1,
/// with weights w_j common to the channels, unknown, and sampled (Gibbs) together with scales and amplitudes.
/// Free decay of an initial state that is not in equilibrium is part of a_ij.
///
/// `ambient` names the channel that measures the room, empty without one; it is an input and gets no
/// estimate. `test_start_s`: rises and equilibrium times count from the level of each channel there, in
/// `window`'s own time; the window itself may begin later, after a regime change (`start_level_C` then holds
/// the channels' levels at the start of the test, by channel in the window's order, NaN where unknown; empty:
/// the window's own start). The same window, options and seed give the same answer bit for bit. Pure: any
/// thread. Errors (refuse_input): options out of bounds, no structural channel, unknown ambient, fewer than 8
/// min of samples.
Result<SpectrumEstimate> estimate_spectrum(const TestWindow& window, std::string_view ambient,
                                           const std::optional<SpectrumPrior>& prior,
                                           const SpectrumOptions& options, std::uint64_t seed,
                                           const std::vector<double>& start_level_C = {});

/// The posterior mean curve of one channel at `time_s`, inside the window from the measured ambient, after it
/// with the ambient at its tail mean. `window` and `ambient` are those of the estimate.
std::vector<double> predict_curve(const SpectrumEstimate& estimate, const ChannelEstimate& channel,
                                  const TestWindow& window, std::string_view ambient,
                                  const std::vector<double>& time_s);

}  // namespace thermbal
