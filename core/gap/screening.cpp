#include <algorithm>
#include <cmath>

#include "candidates.hpp"
#include "ground.hpp"

namespace thermbal {
namespace {

constexpr int onsets_on_grid = 40;
constexpr int onsets_of_the_whole_machine = 200;  ///< a stop of a minute or two is over before the next of 40

/// Values of a shape parameter that a fit may have to begin at to arrive.
std::vector<double> grid_of(const EffectParameterDefinition& definition, const ResolvedPrior& prior,
                            const Observation& seen, const std::vector<double>& periods_s, int onset_count) {
    if (definition.is_time) {
        std::vector<double> onsets;
        const double begin_s = seen.time_s.front(), length_s = seen.time_s.back() - begin_s;
        for (int k = 0; k < onset_count; ++k) onsets.push_back(begin_s + length_s * (k + 0.5) / onset_count);
        return onsets;
    }
    if (definition.name == "period_s") return periods_s;
    if (!std::isfinite(prior.sigma))
        return {prior.lower + 0.25 * (prior.upper - prior.lower), 0.5 * (prior.lower + prior.upper),
                prior.lower + 0.75 * (prior.upper - prior.lower)};
    std::vector<double> values;
    for (const double sigmas : {-1.0, 0.0, 1.0}) {
        const double value = prior.logarithmic ? prior.centre * std::exp(sigmas * prior.sigma)
                                               : prior.centre + sigmas * prior.sigma;
        values.push_back(std::clamp(value, prior.lower, prior.upper));
    }
    return values;
}

/// A cycle of a known period may begin at any moment of it.
std::vector<Effect> with_phases(const std::vector<Effect>& shapes) {
    constexpr int phases = 8;
    std::vector<Effect> result;
    for (const Effect& shape : shapes) {
        for (int k = 0; k < phases; ++k) {
            result.push_back(shape);
            result.back().parameters.push_back({"duty", 0.5, 0.0});
            result.back().parameters.push_back(
                {"first_on_s", -shape.parameter("period_s") * k / phases, 0.0});
        }
    }
    return result;
}

/// Shapes to try: all combinations of the grids of every parameter but the first, which sizes the effect.
std::vector<Effect> shapes_of(const Candidate& candidate, const Model& model, const Observation& seen,
                              const std::vector<double>& periods_s) {
    std::vector<Effect> shapes = {make_effect(*candidate.definition, *candidate.form, candidate.at, model)};
    const int onset_count =
        candidate.form->site == EffectSite::whole_model ? onsets_of_the_whole_machine : onsets_on_grid;
    for (std::size_t p = 1; p < candidate.form->parameters.size(); ++p) {
        const EffectParameterDefinition& definition = candidate.form->parameters[p];
        if (definition.name == "first_on_s") {
            shapes = with_phases(shapes);
            continue;
        }
        if (definition.when_absent) continue;
        const auto values =
            grid_of(definition, resolve_prior(definition, model), seen, periods_s, onset_count);
        std::vector<Effect> wider;
        for (const Effect& shape : shapes) {
            for (const double value : values) {
                wider.push_back(shape);
                auto& parameters = wider.back().parameters;
                std::ranges::find(parameters, definition.name, &EffectParameter::name)->value = value;
            }
        }
        shapes = std::move(wider);
    }
    return shapes;
}

/// How the size is probed: from `neutral`, where the effect does nothing, by one `step` in the size's
/// coordinate.
struct SizeProbe {
    bool relative = false;  ///< the size is a multiple of the probe; else the probe's logarithm is
    double value = 0.0;
};

SizeProbe probe_of(const ResolvedPrior& prior) {
    if (!prior.logarithmic) return {true, std::min(prior.sigma, prior.upper)};
    if (prior.lower < 1.0 && prior.upper > 1.0 && std::abs(prior.centre - 1.0) < 1e-9) {
        return {false, std::exp(0.5 * prior.sigma)};  // a factor that does nothing at 1
    }
    return {true, prior.centre};
}

double size_of(const SizeProbe& probe, double amplitude, const ResolvedPrior& prior) {
    const double wanted = probe.relative ? probe.value * amplitude : std::pow(probe.value, amplitude);
    const double least = prior.logarithmic && probe.relative ? 0.02 * probe.value : wanted;
    return std::clamp(std::max(wanted, least), prior.lower, prior.upper);
}

}  // namespace

Screened screen(const Candidate& candidate, const ScreeningGround& ground,
                const std::vector<double>& periods_s) {
    const Observation& seen = ground.run();
    const Model& model = ground.model();
    const ResolvedPrior prior = resolve_prior(candidate.form->parameters.front(), model);
    std::vector<SizeProbe> probes = {probe_of(prior)};
    // A size that is a length of time changes the effect's shape: a stop of a minute is not a tenth of one of
    // ten.
    if (candidate.form->parameters.front().name == "duration_s") {
        probes.push_back({true, std::max(0.1 * prior.centre, seen.bin_s)});
    }
    Screened best{candidate, make_effect(*candidate.definition, *candidate.form, candidate.at, model), 0.0};
    for (const SizeProbe& probe : probes) {
        for (Effect& shape : shapes_of(candidate, model, seen, periods_s)) {
            shape.parameters.front().value = probe.value;
            const auto change = ground.change_by(shape);
            if (!change) continue;
            const auto gain = ground.linearisation().gain_of(*change);
            const bool one_sided = probe.relative && prior.lower >= 0.0;
            if (one_sided && gain.amplitude <= 0.0) continue;
            if (gain.log_likelihood <= best.log_likelihood_gain) continue;
            best.log_likelihood_gain = gain.log_likelihood;
            best.start = shape;
            best.start.parameters.front().value = size_of(probe, gain.amplitude, prior);
        }
    }
    return best;
}

}  // namespace thermbal
