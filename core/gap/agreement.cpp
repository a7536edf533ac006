#include "gap/agreement.hpp"

#include <algorithm>

#include "disagreement.hpp"
#include "fit.hpp"

namespace thermbal {
namespace {

double length_s(const RecordedTest& test) {
    return test.time_s.empty() ? 0.0 : test.time_s.back() - test.time_s.front();
}

/// Four hundred bins describe a test of any length.
CalibrationOptions binned(const AgreementOptions& options, double test_s) {
    CalibrationOptions calibration = options.calibration;
    calibration.bin_s = std::max(options.least_bin_s, test_s / 400.0);
    return calibration;
}

/// `found`: strongest first.
ChannelAgreement agreement_of(const std::string& channel, const std::vector<Disagreement>& found,
                              double limit_sigmas, double lasts_s) {
    ChannelAgreement agreement{.channel = channel};
    for (const Disagreement& one : found) {
        if (one.channel != channel || one.sigmas < limit_sigmas || one.to_s - one.from_s < lasts_s) continue;
        return {channel, true, one.from_s, one.to_s, one.peak_C, one.sigmas};
    }
    return agreement;
}

}  // namespace

Result<std::vector<ChannelAgreement>> check_agreement(const Model& model, const RecordedTest& test,
                                                      std::span<const std::string> disagreeing,
                                                      const AgreementOptions& options,
                                                      const Cancelled& cancelled) {
    if (const auto valid = validate(model); !valid) return std::unexpected(valid.error());
    std::vector<ChannelAgreement> channels;
    if (length_s(test) < options.least_window_s) return channels;
    const CalibrationOptions calibration = binned(options, length_s(test));
    const auto data = make_fit_data(model, test, calibration);
    if (!data) return std::unexpected(data.error());
    const FitProblem problem(*data, model);
    const auto fit =
        minimise(problem, {problem.prior_coordinates(), nullptr}, calibration, sequential_for, cancelled);
    if (!fit) return std::unexpected(fit.error());
    const auto found = disagreements_of(*data, fit->point, calibration.fidelity);
    for (const std::string& channel : data->seen.channels) {
        const bool disagreed = std::ranges::find(disagreeing, channel) != disagreeing.end();
        channels.push_back(agreement_of(
            channel, found, disagreed ? options.ends_sigmas : options.begins_sigmas, options.lasts_s));
    }
    return channels;
}

}  // namespace thermbal
