#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// A few exponentials that all channels share: y_i(t) = level_i + sum_k amplitude_ik (1 - exp(-t/tau_k)), t
/// from the start.
struct SharedModes {
    std::vector<double> time_constant_min;
    struct Channel {
        std::string channel;
        double level_C = 0.0;
        std::vector<double> amplitude_C;  ///< one a time constant
        double noise_C = 0.0;             ///< of one sample, rounding included
    };
    std::vector<Channel> channels;
    double residual_rms_C = 0.0;  ///< of block means about the fit
};

/// Fits `modes` shared exponentials to every structural channel by separable least squares (Golub and Pereyra
/// 1973 with Kaufman's derivative): the time constants by Levenberg-Marquardt, the amplitudes eliminated.
/// With `ambient` its deviation from the start, lagged by each time constant, is fitted along. Meant for
/// complete recordings. Errors (refuse_input): no structural channel, unknown ambient, fewer samples than
/// unknowns.
Result<SharedModes> fit_shared_modes(const TestWindow& window, std::string_view ambient, std::size_t modes);

/// The smallest number of modes, at most `most`, that a Bayesian information criterion asks for.
Result<SharedModes> fit_shared_modes_of_best_order(const TestWindow& window, std::string_view ambient,
                                                   std::size_t most);

/// Which knowledge the bound may use.
enum class SharedKnowledge {
    single_channel,   ///< one channel, its own time constants unknown
    joint,            ///< all channels, time constants common and unknown
    joint_with_prior  ///< as joint, every time constant known beforehand to `relative_sd`
};

/// Cramer-Rao bound: the least standard deviation, in C, that an unbiased estimate of each channel's steady
/// state can have from samples every `period_s` up to `until_min`, the order known. With D_i the derivatives
/// of channel i's curve by log tau_k, X the linear basis and P its projector, time constants carry J = sum_i
/// D_i' (1 - P) D_i / sigma_i^2 (plus 1/relative_sd^2 on the diagonal), and var_i = sigma_i^2 c'(X'X)^-1 c +
/// g_i' J^-1 g_i, g_i = c'(X'X)^-1 X' D_i. One value a channel, in the order of `truth.channels`; infinite
/// where the samples do not determine it.
std::vector<double> steady_state_bound_C(const SharedModes& truth, double period_s, double until_min,
                                         SharedKnowledge knowledge, double relative_sd = 0.1);

/// The earliest minute, in steps of `step_min` up to `latest_min`, at which each channel's bound allows
/// +-tolerance_C at 90 % (bound * 1.645 <= tolerance); infinite where none does.
std::vector<double> earliest_possible_min(const SharedModes& truth, double period_s, double tolerance_C,
                                          double latest_min, SharedKnowledge knowledge, double step_min = 1.0,
                                          double relative_sd = 0.1);

}  // namespace thermbal
