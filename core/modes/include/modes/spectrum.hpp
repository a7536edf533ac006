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

/// How a test mixes the responses of earlier tests: alike on all channels, since one split of the heat and
/// one speed make the mixture.
struct MixtureOptions {
    double prior_sd = 1.0;    ///< of each test's share; an archived test itself lies at 1 in one of them
    double channel_sd = 0.3;  ///< by which a channel's own mixture differs from the common one
};

/// How the shared spectrum of time constants is estimated. Defaults hold for a machine tool's spindle head on
/// a 15 s grid; `check` names the field that is out of bounds.
struct SpectrumOptions {
    double block_min = 1.0;    ///< samples are averaged over blocks of this length
    double fastest_min = 1.0;  ///< range of the modes' time constants
    double slowest_min = 600.0;
    std::size_t grid = 120;  ///< points of the modes' logarithmic grid; between them columns are interpolated

    double expected_modes = 5.0;  ///< a priori, over the whole range
    double falloff_min = 60.0;    ///< beyond this time constant modes are rarer ...
    double falloff_power = 2.0;   ///< ... as (falloff / tau)^power
    double mode_log_variance_mean =
        -3.0;  ///< of a mode's variance relative to the channel's squared scale, natural log
    double mode_log_variance_sd = 2.0;
    double same_sign = 0.5;  ///< slow modes move all channels the same way: share of their rms amplitude ...
    double same_sign_min = 30.0;  ///< ... reached well above this time constant
    double scale_floor = 0.5;  ///< least scale of a channel, as a share of the median range of all channels

    std::size_t background_points =
        28;                          ///< grid of the continuous background and of the response to the room
    double background_level = 2e-4;  ///< variance of a background amplitude, relative to the squared scale

    // Friction falls as the machine warms: a channel follows the room the less, the more its own heat raises
    // it.
    double ambient_gain_loss_per_C =
        0.012;  ///< in the end it follows with a gain of 1 less this times its rise so far ...
    double ambient_gain_sd = 0.02;     ///< ... give or take this and the loss itself
    double ambient_centre_min = 60.0;  ///< median time constant of the response to the room, a priori
    double ambient_spread = 1.2;       ///< its spread, sd of log(tau)
    double ambient_modes_share = 0.9;  ///< of the response to the room lies where the modes are
    double ambient_matters_C = 0.4;    ///< a room that moves less is not worth a second pass
    double ambient_tail_min = 15.0;    ///< the ambient stays at its mean over the last so many minutes

    double archive_deviation =
        0.15;  ///< with archived responses modes only carry what differs: this share of the scale

    MixtureOptions mixture;

    std::size_t burn_in = 1500;  ///< Metropolis-Hastings steps that are thrown away
    std::size_t draws = 400;     ///< states that are kept
    std::size_t thinning = 30;   ///< steps between them
    /// Factor on the posterior's half width. On the finite-volume machines the errors were 0.75 posterior
    /// standard deviations (rms) while a window began with its test, and 1.0 to 1.5 after a regime change:
    /// there, and under an archive, the posterior stands as it is.
    double interval_factor = 0.8;
    /// No model of a machine is better than this, however long it was measured: added to the half width in
    /// quadrature, in C, as a share of the room's range over the last hour (a cycling room has no one mean),
    /// and as a share of what the room has done and the channel has yet to follow.
    double model_floor_C = 0.04;
    double room_floor = 0.05;
    double room_to_come_floor = 0.2;

    Result<void> check() const;
};

/// What earlier tests of the same machine say about its modes, on the grid of time constants: expected number
/// of modes a cell, and mean and spread of the logarithm of their relative variance. See modes/archive.hpp.
struct SpectrumPrior {
    /// How one channel answered the heat in earlier tests, scaled to a rise of 1: amplitudes on the
    /// background's grid, then on the modes' grid; the mean over tests first, then each test's difference
    /// from it.
    struct Response {
        std::string channel;
        std::vector<std::vector<double>> shape;
    };
    std::vector<Response> responses;
    std::vector<double> time_constant_min;
    std::vector<double> intensity;
    std::vector<double> log_variance_mean;
    std::vector<double> log_variance_sd;
    std::size_t tests = 0;
};

/// One channel as the spectrum sees it. Intervals are central 90 %; a steady state's lies evenly about it.
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
    double room_rise_C = 0.0;         ///< what of it is the room's, moved since the start of the test
    double room_to_come_C = 0.0;      ///< what of steady state less last level the room has already done
    double noise_C = 0.0;             ///< standard deviation of one sample about the fit
    double resolution_C = 0.0;        ///< smallest step between readings
    double residual_rms_C = 0.0;      ///< of block means about the fit
    double variance_inflation = 1.0;  ///< integrated autocorrelation of the residuals, >= 1; 1 is white
    double slowest_time_constant_min =
        0.0;  ///< slowest that carries at least 5 % of this channel's amplitudes
    std::size_t good_samples = 0;

    /// What the machine's own heat does in a room that stays: of the whole test, and from now on.
    double own_rise_C() const { return rise_C - room_rise_C; }
    double own_to_come_C() const { return steady_state_C - last_C - room_to_come_C; }

    bool used_responses = false;       ///< archived responses of this channel took part
    std::vector<double> coefficients;  ///< posterior mean, for predict_curve
};

struct SpectrumEstimate {
    std::vector<ChannelEstimate> channels;
    std::vector<double> time_constant_min;  ///< grid of the modes
    std::vector<double> mode_density;       ///< posterior expected number of modes in each cell of the grid
    std::vector<double>
        mode_log_variance;        ///< posterior mean log relative variance there; the prior's where none is
    double expected_modes = 0.0;  ///< posterior mean of their number
    double window_start_s = 0.0;
    double window_end_s = 0.0;
    double ambient_reference_C = 0.0;  ///< mean over the first minutes of the window; 0 without ambient
    double ambient_tail_C = 0.0;       ///< mean over the last 15 min; 0 without ambient
    bool has_ambient = false;
    double slowest_time_constant_min = 0.0;  ///< slowest that carries at least 5 % of all amplitudes
    std::size_t blocks = 0;                  ///< rows the fit saw
    std::vector<double> background_time_constant_min;
    /// Posterior median of the summed relative variances of the modes: how much amplitude, in squared scales,
    /// they carry. Under an archive's responses, far above its prior's if these cannot be bent to the
    /// samples.
    double mode_energy = 0.0;

    /// Archived responses took part on some channel.
    bool used_responses() const;
};

/// Estimates where every structural channel of `window` settles from time constants that all of them share.
/// With x(t; tau) = 1 - exp(-t/tau), modes tau_k, k = 1 ... K, and u the ambient's deviation from its start,
/// channel i is
///     y_i(t) = m_i + sum_k a_ik x(t; tau_k) + background + sum_j b_ij (u through a lag tau_j) + noise,
///     a_ik ~ N(0, s_i^2 v_k),   sum_j b_ij ~ 1.
/// K, tau_k and v_k are unknown and sampled (reversible jump), everything linear is marginalised exactly.
/// Free decay of an initial state that is not in equilibrium is part of the a_ik.
///
/// `ambient` names the channel that measures the room, empty without one; it is an input and gets no
/// estimate. Rises and equilibrium times count from `start_level_C` (by channel in the window's order, NaN
/// where unknown) if the window begins after the start of the test, at a regime change; empty: from the
/// window's own start. The same window, options and seed give the same answer bit for bit. Pure: any thread.
/// Errors (refuse_input): options out of bounds, no structural channel, unknown ambient, fewer than 8 min of
/// samples.
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
