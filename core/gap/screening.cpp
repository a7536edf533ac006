#include <algorithm>
#include <cmath>
#include <optional>

#include "candidates.hpp"
#include "ground.hpp"

namespace thermbal {
namespace {

constexpr int onsets_on_grid = 12;  ///< to begin with; halved twice around the best
constexpr int onsets_of_a_stop = 40;

std::vector<double> spread_over(const Observation& seen, int count) {
    std::vector<double> moments_s;
    moments_s.reserve(static_cast<std::size_t>(count));
    const double begin_s = seen.time_s.front(), length_s = seen.time_s.back() - begin_s;
    for (int k = 0; k < count; ++k) moments_s.push_back(begin_s + length_s * (k + 0.5) / count);
    return moments_s;
}

/// A column knows a change to within a row: what looks like a stop right beside it is that.
void leave_out_known_changes(std::vector<double>& onsets_s, const Model& model, const Observation& seen) {
    constexpr double bins = 2.5;
    for (const double change_s : drive_changes_s(model, seen.inputs))
        std::erase_if(onsets_s,
                      [&](double onset_s) { return std::abs(onset_s - change_s) < bins * seen.bin_s; });
}

/// Values of a shape parameter that a fit may have to begin at to arrive.
std::vector<double> grid_of(const EffectParameterDefinition& definition, const ResolvedPrior& prior,
                            const Model& model, const Observation& seen, const ResidualTiming& timing,
                            bool of_a_stop) {
    if (definition.is_time && !of_a_stop) return spread_over(seen, onsets_on_grid);
    if (definition.is_time) {
        std::vector<double> onsets = spread_over(seen, onsets_of_a_stop);
        for (const double moment_s : timing.moments_s) {  // one of seconds is over before the next of these
            for (const double bins : {-1.5, -1.0, -0.5}) onsets.push_back(moment_s + bins * seen.bin_s);
        }
        leave_out_known_changes(onsets, model, seen);
        return onsets;
    }
    if (definition.name == "period_s") return timing.periods_s;
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
            result.back().set_parameter("duty", 0.5);
            result.back().set_parameter("first_on_s", -shape.parameter("period_s") * k / phases);
        }
    }
    return result;
}

bool is_a_stop(const Candidate& candidate) {
    return candidate.form->parameters.front().name == "duration_s";
}

/// Shapes to try: all combinations of the grids of every parameter but the first, which sizes the effect.
std::vector<Effect> shapes_of(const Candidate& candidate, const Model& model, const Observation& seen,
                              const ResidualTiming& timing) {
    std::vector<Effect> shapes = {make_effect(*candidate.definition, *candidate.form, candidate.at, model)};
    for (std::size_t p = 1; p < candidate.form->parameters.size(); ++p) {
        const EffectParameterDefinition& definition = candidate.form->parameters[p];
        if (definition.name == "first_on_s") {
            shapes = with_phases(shapes);
            continue;
        }
        if (definition.when_absent) continue;
        const auto values =
            grid_of(definition, resolve_prior(definition, model), model, seen, timing, is_a_stop(candidate));
        std::vector<Effect> wider;
        for (const Effect& shape : shapes) {
            for (const double value : values) {
                wider.push_back(shape);
                wider.back().set_parameter(definition.name, value);
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
    std::optional<double> reach;  ///< the factor by which the size may be off it; absent: any
};

SizeProbe probe_of(const ResolvedPrior& prior) {
    if (!prior.logarithmic) return {true, std::min(prior.sigma, prior.upper), {}};
    if (prior.lower < 1.0 && prior.upper > 1.0 && std::abs(prior.centre - 1.0) < 1e-9) {
        return {false, std::exp(0.5 * prior.sigma), {}};  // a factor that does nothing at 1
    }
    return {true, prior.centre, {}};
}

/// Where a size that changes the effect's shape is probed: a stop of a minute is no tenth of one of ten, and
/// a small mass soon follows its node where a large one takes heat all the time.
std::vector<SizeProbe> probes_of(const Candidate& candidate, const ResolvedPrior& prior, double bin_s) {
    std::vector<SizeProbe> probes = {probe_of(prior)};
    if (is_a_stop(candidate)) probes.push_back({true, std::max(0.1 * prior.centre, bin_s), {}});
    if (candidate.form->parameters.front().name != "heat_capacity_J_per_K") return probes;
    probes.clear();
    for (const double sigmas : {-2.0, -1.0, 0.0, 1.0})
        probes.push_back({true, prior.centre * std::exp(sigmas * prior.sigma), std::exp(0.5 * prior.sigma)});
    return probes;
}

double size_of(const SizeProbe& probe, double amplitude, const ResolvedPrior& prior) {
    const double wanted = probe.relative ? probe.value * amplitude : std::pow(probe.value, amplitude);
    const double least = prior.logarithmic && probe.relative ? 0.02 * probe.value : wanted;
    return std::clamp(std::max(wanted, least), prior.lower, prior.upper);
}

/// The onset of a candidate that has no other shape: heat that sets in, or a sensor's error that does. What
/// it does after one onset tells what it does after all. Null for others.
const EffectParameterDefinition* onset_alone(const Candidate& candidate) {
    const EffectForm& form = *candidate.form;
    const bool linear = form.site == EffectSite::node || form.site == EffectSite::channel;
    if (!linear || form.parameters.size() != 2) return nullptr;
    const EffectParameterDefinition& shape = form.parameters.back();
    return shape.is_time && !shape.when_absent ? &shape : nullptr;
}

/// Keeps the shape that gains most.
class BestShape {
  public:
    BestShape(const Candidate& candidate, const ScreeningGround& ground)
        : ground_(&ground),
          prior_(resolve_prior(candidate.form->parameters.front(), ground.model())),
          best_{candidate, make_effect(*candidate.definition, *candidate.form, candidate.at, ground.model()),
                0.0},
          onset_(onset_alone(candidate)) {
        if (onset_ == nullptr) return;
        Effect probed = best_.start;
        probed.parameters.front().value = probe_of(prior_).value;
        auto courses = ground.courses_from_the_beginning(std::move(probed), onset_->name);
        if (courses) courses_ = std::move(*courses);
    }

    const ResolvedPrior& prior() const { return prior_; }
    const Screened& found() const { return best_; }

    void look_at(Effect shape, const SizeProbe& probe) {
        shape.parameters.front().value = probe.value;
        const auto change = change_by(shape);
        if (!change) return;
        auto gain = ground_->linearisation().gain_of(*change);
        const bool one_sided = probe.relative && prior_.lower >= 0.0;
        if (one_sided && gain.amplitude <= 0.0) return;
        if (probe.reach) gain = gain.at(std::clamp(gain.amplitude, 1.0 / *probe.reach, *probe.reach));
        if (gain.log_likelihood <= best_.log_likelihood_gain) return;
        best_.log_likelihood_gain = gain.log_likelihood;
        best_.start = std::move(shape);
        best_.start.parameters.front().value = size_of(probe, gain.amplitude, prior_);
        best_probe_ = probe;
    }

    /// Moves the onset of the best shape to both sides, twice, half as far each time.
    void refine_onset(const std::string& onset) {
        double step_s = (ground_->run().time_s.back() - ground_->run().time_s.front()) / onsets_on_grid;
        for (int round = 0; round < 2; ++round) {
            step_s *= 0.5;
            const Effect middle = best_.start;
            for (const double side : {-1.0, 1.0}) {
                Effect moved = middle;
                moved.set_parameter(onset, moved.parameter(onset) + side * step_s);
                look_at(std::move(moved), best_probe_);
            }
        }
    }

  private:
    Result<Eigen::VectorXd> change_by(const Effect& shape) const {
        if (!courses_) return ground_->change_by(shape);
        const bool remembers = best_.candidate.form->site == EffectSite::node;
        return ground_->change_from(*courses_, shape.parameter(onset_->name), remembers);
    }

    const ScreeningGround* ground_;
    ResolvedPrior prior_;
    Screened best_;
    SizeProbe best_probe_;
    const EffectParameterDefinition* onset_;
    std::optional<std::vector<CourseOfReadings>> courses_;  ///< of the only probe there is, by run
};

}  // namespace

std::vector<double> drive_changes_s(const Model& model, const Inputs& inputs) {
    std::vector<double> moments_s = {inputs.time_s.front()};
    for (const Column& column : inputs.columns) {
        if (std::ranges::find(model.sources, column.name, &Source::proportional_to) == model.sources.end())
            continue;
        for (std::size_t row = 1; row < column.values.size(); ++row) {
            const double before = column.values[row - 1], after = column.values[row];
            if (std::abs(after - before) > 0.05 * std::max(std::abs(after), std::abs(before)))
                moments_s.push_back(inputs.time_s[row]);
        }
    }
    return moments_s;
}

Screened screen(const Candidate& candidate, const ScreeningGround& ground, const ResidualTiming& timing) {
    const Observation& seen = ground.run();
    BestShape best(candidate, ground);
    for (const SizeProbe& probe : probes_of(candidate, best.prior(), seen.bin_s)) {
        for (Effect& shape : shapes_of(candidate, ground.model(), seen, timing))
            best.look_at(std::move(shape), probe);
    }
    for (const EffectParameterDefinition& definition : candidate.form->parameters) {
        const bool on_grid = definition.is_time && !definition.when_absent && !is_a_stop(candidate);
        if (on_grid && best.found().log_likelihood_gain > 0.0) best.refine_onset(definition.name);
    }
    return best.found();
}

}  // namespace thermbal
