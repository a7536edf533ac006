#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "modes/spectrum.hpp"

namespace thermbal {

/// How a prior is learnt from earlier tests of the same machine.
struct ArchiveOptions {
    double blur_log_tau =
        0.08;  ///< time constants of a test are known, and repeat, to about this (sd of log tau)
    double generic_share =
        0.25;  ///< of the modes may be such as no earlier test had: the first test's prior, thinned
    double log_variance_sd_least = 0.7;
    double least_rise_C = 0.8;        ///< a channel that rose less leaves no response
    bool use_responses = true;        ///< off after a warm start: earlier responses are from cold
    std::size_t tests_for_trust = 1;  ///< fewer tests give no prior
};

/// The modes that a finished test leaves for the archive: what SpectrumEstimate says on its complete window.
/// Plain vectors of the grid's length, made to be stored.
struct ArchivedSpectrum {
    struct Response {
        std::string channel;
        double rise_C = 0.0;
        std::vector<double> amplitude_C;  ///< on the background's grid, then on the modes'
    };
    std::vector<Response> responses;
    std::vector<double> time_constant_min;
    std::vector<double> mode_density;
    std::vector<double> mode_log_variance;
};

ArchivedSpectrum archived(const SpectrumEstimate& complete_test);

/// Learns the prior of the next test: the mean over tests of the modes' density, blurred by what differs
/// between tests, plus a share of the generic prior of `spectrum`. Between tests that disagree the density
/// spreads by itself. Errors (refuse_input): no test, or a test on another grid.
Result<SpectrumPrior> learn_prior(const std::vector<ArchivedSpectrum>& tests, const SpectrumOptions& spectrum,
                                  const ArchiveOptions& options);

/// Whether a window contradicts the archive: its responses, freely scaled and mixed, do not fit, so that the
/// modes, meant for small differences, carry much amplitude. Matching machines stay below 1.3, other machines
/// of the same kind lie at 4 and far above (README).
struct Contradiction {
    bool contradicted = false;
    double mode_energy = 0.0;
    std::string reason;  ///< one line for a person, with the figures; empty without contradiction
};

Contradiction contradiction_of(const SpectrumEstimate& with_archive, double allowed_mode_energy = 2.0);

/// The estimate with the archive's prior, on each channel the narrower of with and without; if the window
/// contradicts the archive, without.
struct ArchivedEstimate {
    SpectrumEstimate estimate;
    Contradiction contradiction;
};

Result<ArchivedEstimate> estimate_with_archive(const TestWindow& window, std::string_view ambient,
                                               const SpectrumPrior& prior, const SpectrumOptions& options,
                                               std::uint64_t seed,
                                               const std::vector<double>& start_level_C = {});

}  // namespace thermbal
