#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "gap/calibrate.hpp"
#include "network/model.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// When a running test contradicts a model. What a test says of a channel must not flicker: it takes more to
/// begin a disagreement than to keep it.
struct AgreementOptions {
    /// Looked at every few minutes for days: more is allowed than in a diagnosis, which pays for every name.
    CalibrationOptions calibration{.fidelity = {.share_of_rise = 0.003, .place_share = 0.01}};
    double least_window_s = 1200.0;  ///< a shorter test says nothing yet
    double least_bin_s = 60.0;       ///< readings are averaged over bins of this, longer in a long test
    double begins_sigmas = 4.0;      ///< of noise and fidelity, the residual smoothed over ten bins
    double ends_sigmas = 3.0;
    double lasts_s = 600.0;  ///< a shorter one is none
};

/// One channel of the model in a test so far.
struct ChannelAgreement {
    std::string channel;
    bool disagrees = false;
    double from_s = 0.0;  ///< of the strongest disagreement; nothing below is set where there is none
    double to_s = 0.0;
    double peak_C = 0.0;  ///< measured - simulated, smoothed
    double sigmas = 0.0;
};

/// Whether a test so far can be what the model says: its uncertain numbers are fitted to the test within what
/// the model states of them (calibrate); what noise and the model's fidelity do not allow of the rest is a
/// disagreement, whenever in the test it was. `disagreeing`: the channels that disagreed before. Pure; empty
/// while the test is too short. Errors: those of calibrate; stop when cancelled. Any thread.
Result<std::vector<ChannelAgreement>> check_agreement(const Model& model, const RecordedTest& test,
                                                      std::span<const std::string> disagreeing,
                                                      const AgreementOptions& options = {},
                                                      const Cancelled& cancelled = never_cancelled);

}  // namespace thermbal
