#include "modes/archive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "generic_prior.hpp"

namespace thermbal {

namespace {

double log_spacing(const std::vector<double>& grid) {
    return std::log(grid[1] / grid[0]);
}

/// A channel's responses in all tests that have it: their mean first, then the differences from it.
std::optional<SpectrumPrior::Response> learn_response(const std::vector<ArchivedSpectrum>& tests,
                                                      const std::string& channel, double least_rise_C) {
    std::vector<std::vector<double>> shapes;
    for (const ArchivedSpectrum& test : tests) {
        for (const ArchivedSpectrum::Response& response : test.responses) {
            if (response.channel != channel || std::abs(response.rise_C) < least_rise_C) continue;
            double settled = 0.0;
            for (const double amplitude : response.amplitude_C) settled += amplitude;
            if (std::abs(settled) < 0.5 * least_rise_C) continue;
            shapes.push_back(response.amplitude_C);
            for (double& amplitude : shapes.back()) amplitude /= settled;
        }
    }
    if (shapes.empty()) return std::nullopt;
    std::vector<double> mean(shapes.front().size(), 0.0);
    for (const std::vector<double>& shape : shapes) {
        if (shape.size() != mean.size()) return std::nullopt;
        for (std::size_t g = 0; g < mean.size(); ++g)
            mean[g] += shape[g] / static_cast<double>(shapes.size());
    }
    SpectrumPrior::Response response{channel, {mean}};
    if (shapes.size() < 2) return response;
    for (std::vector<double>& shape : shapes) {
        for (std::size_t g = 0; g < mean.size(); ++g) shape[g] -= mean[g];
        response.shape.push_back(std::move(shape));
    }
    return response;
}

double width_C(const ChannelEstimate& channel) {
    return channel.steady_state_high_C - channel.steady_state_low_C;
}

/// A channel that did what no earlier test did is known better without them. Both estimates have the same
/// channels.
void take_narrower(const SpectrumEstimate& plain, SpectrumEstimate& informed) {
    for (std::size_t i = 0; i < informed.channels.size(); ++i) {
        if (width_C(plain.channels[i]) < width_C(informed.channels[i]))
            informed.channels[i] = plain.channels[i];
    }
}

}  // namespace

ArchivedSpectrum archived(const SpectrumEstimate& complete_test) {
    ArchivedSpectrum spectrum;
    spectrum.time_constant_min = complete_test.time_constant_min;
    spectrum.mode_density = complete_test.mode_density;
    spectrum.mode_log_variance = complete_test.mode_log_variance;
    const auto background = static_cast<std::ptrdiff_t>(complete_test.background_time_constant_min.size());
    const std::ptrdiff_t ambient = complete_test.has_ambient ? background : 0;
    for (const ChannelEstimate& channel : complete_test.channels) {
        ArchivedSpectrum::Response response{channel.channel, channel.rise_C, {}};
        const auto first = channel.coefficients.begin() + 1;
        response.amplitude_C.assign(first, first + background);
        response.amplitude_C.insert(response.amplitude_C.end(), first + background + ambient,
                                    channel.coefficients.end());
        spectrum.responses.push_back(std::move(response));
    }
    return spectrum;
}

Result<SpectrumPrior> learn_prior(const std::vector<ArchivedSpectrum>& tests, const SpectrumOptions& spectrum,
                                  const ArchiveOptions& options) {
    if (tests.size() < std::max<std::size_t>(1, options.tests_for_trust)) {
        return fail(NextStep::refuse_input,
                    fmt::format("{} earlier tests are not enough to learn from", tests.size()));
    }
    const GenericPrior generic = generic_prior(spectrum);
    const std::size_t points = generic.time_constant_min.size();
    for (const ArchivedSpectrum& test : tests) {
        const bool fits =
            test.time_constant_min.size() == points && test.mode_density.size() == points &&
            test.mode_log_variance.size() == points &&
            std::abs(test.time_constant_min.back() / generic.time_constant_min.back() - 1.0) < 1e-6;
        if (!fits) {
            return fail(
                NextStep::refuse_input,
                fmt::format(
                    "a stored spectrum has {} time constants, {} are expected: identify that test again",
                    test.time_constant_min.size(), points));
        }
    }
    const double spacing = log_spacing(generic.time_constant_min);
    const double reach = options.blur_log_tau / spacing;
    SpectrumPrior prior;
    prior.time_constant_min = generic.time_constant_min;
    prior.tests = tests.size();
    for (std::size_t g = 0; g < points; ++g) {
        double density = 0.0;
        double log_variance = 0.0;
        double square = 0.0;
        for (const ArchivedSpectrum& test : tests) {
            for (std::size_t other = 0; other < points; ++other) {
                const double z = (static_cast<double>(g) - static_cast<double>(other)) / reach;
                if (std::abs(z) > 4.0) continue;
                const double weight = std::exp(-0.5 * z * z) / (reach * std::sqrt(2.0 * std::numbers::pi)) *
                                      test.mode_density[other] / static_cast<double>(tests.size());
                density += weight;
                log_variance += weight * test.mode_log_variance[other];
                square += weight * test.mode_log_variance[other] * test.mode_log_variance[other];
            }
        }
        const double strange = options.generic_share * generic.intensity[g];
        density += strange;
        log_variance += strange * generic.log_variance_mean[g];
        square += strange * (generic.log_variance_mean[g] * generic.log_variance_mean[g] +
                             generic.log_variance_sd[g] * generic.log_variance_sd[g]);
        const double mean = log_variance / density;
        const double spread = std::sqrt(std::max(0.0, square / density - mean * mean));
        prior.intensity.push_back(density);
        prior.log_variance_mean.push_back(mean);
        prior.log_variance_sd.push_back(std::max(options.log_variance_sd_least, spread));
    }
    if (!options.use_responses) return prior;
    for (const ArchivedSpectrum::Response& response : tests.front().responses) {
        std::optional<SpectrumPrior::Response> learnt =
            learn_response(tests, response.channel, options.least_rise_C);
        if (learnt) prior.responses.push_back(std::move(*learnt));
    }
    return prior;
}

Contradiction contradiction_of(const SpectrumEstimate& with_archive, double allowed_mode_energy) {
    Contradiction result;
    result.mode_energy = with_archive.mode_energy;
    result.contradicted = with_archive.used_responses() && with_archive.mode_energy > allowed_mode_energy;
    if (!result.contradicted) return result;
    result.reason = fmt::format(
        "earlier tests of this machine do not fit this one (what they leave over is {:.2f}, {:.2f} is "
        "allowed): the machine "
        "or its start differs, the archive is not used",
        result.mode_energy, allowed_mode_energy);
    return result;
}

Result<ArchivedEstimate> estimate_with_archive(const TestWindow& window, std::string_view ambient,
                                               const SpectrumPrior& prior, const SpectrumOptions& options,
                                               std::uint64_t seed, const std::vector<double>& start_level_C) {
    Result<SpectrumEstimate> informed =
        estimate_spectrum(window, ambient, prior, options, seed, start_level_C);
    if (!informed) return std::unexpected(informed.error());
    Contradiction contradiction = contradiction_of(*informed);
    Result<SpectrumEstimate> plain =
        estimate_spectrum(window, ambient, std::nullopt, options, seed, start_level_C);
    if (!plain) return std::unexpected(plain.error());
    if (contradiction.contradicted) return ArchivedEstimate{std::move(*plain), std::move(contradiction)};
    take_narrower(*plain, *informed);
    return ArchivedEstimate{std::move(*informed), std::move(contradiction)};
}

}  // namespace thermbal
