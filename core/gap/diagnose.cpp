#include "gap/diagnose.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "carry_over.hpp"
#include "comparison.hpp"
#include "describe.hpp"
#include "disagreement.hpp"
#include "fidelity.hpp"
#include "search.hpp"
#include "size_at_bound.hpp"
#include "spread.hpp"
#include "thermostats.hpp"

namespace thermbal {
namespace {

/// Measured channels that the model has no sensor for: one of them may be the room.
std::vector<std::string> channels_without_sensor(const Model& model, const RecordedTest& test) {
    std::vector<std::string> names;
    for (const Column& channel : test.channels) {
        if (!find_sensor(model, channel.name) && channel.name != model.ambient.column)
            names.push_back(channel.name);
    }
    return names;
}

Result<Evidence> gather(const Model& model, const RecordedTest& test, std::span<const Holdout> holdouts,
                        const DiagnoseOptions& options, const ParallelFor& parallel_for) {
    if (const auto valid = validate(model); !valid) return std::unexpected(valid.error());
    auto run = make_fit_data(model, test, options.calibration);
    if (!run) return std::unexpected(run.error());
    Evidence evidence{
        model, std::move(*run), {}, channels_without_sensor(model, test), options.calibration, parallel_for};
    for (const Holdout& holdout : holdouts) {
        auto data = make_fit_data(model, holdout.test, options.calibration);
        if (!data) return fail(data.error().next, fmt::format("{}: {}", holdout.name, data.error().message));
        evidence.holdouts.push_back(std::move(*data));
    }
    return evidence;
}

GapVerdict verdict_of(const SearchResult& search) {
    const bool rest =
        search.left.something_is_missing() || std::ranges::any_of(search.steps, &Step::doubtful);
    if (search.steps.empty()) return rest ? GapVerdict::unexplained : GapVerdict::agrees;
    return rest ? GapVerdict::partly_explained : GapVerdict::explained;
}

std::string reason_of(const SearchResult& search, const Diagnosis& diagnosis) {
    const std::string odds =
        fmt::format("probability that nothing {} missing {:.2g}, that it has no name in the catalogue {:.2g}",
                    search.steps.empty() ? "is" : "more is", search.left.nothing, search.left.nameless);
    switch (diagnosis.verdict) {
        case GapVerdict::agrees:
            return "nothing beyond the noise and the model's own fidelity: " + odds;
        case GapVerdict::explained:
            return "the effects found bring the residual down to the noise: " + odds;
        case GapVerdict::partly_explained:
            return "the effects found leave something over: " + odds;
        case GapVerdict::unexplained:
            break;
    }
    return "something is missing that no effect of the catalogue accounts for: " + odds;
}

Result<void> compare_runs(const Evidence& evidence, const RecordedTest& test,
                          std::span<const Holdout> holdouts, const DiagnoseOptions& options,
                          Diagnosis& diagnosis) {
    auto run = compare_run(options.found_on, test, evidence.run, diagnosis.calibrated, diagnosis.extended);
    if (!run) return std::unexpected(run.error());
    diagnosis.run = std::move(*run);
    for (std::size_t k = 0; k < holdouts.size(); ++k) {
        auto held = compare_run(holdouts[k].name, holdouts[k].test, evidence.holdouts[k],
                                diagnosis.calibrated, diagnosis.extended);
        if (!held)
            return fail(held.error().next, fmt::format("{}: {}", holdouts[k].name, held.error().message));
        diagnosis.holdouts.push_back(std::move(*held));
    }
    return {};
}

/// Calibrates with the numbers taken for as uncertain as the run shows them to be. Leaves in `evidence` what
/// that was.
Result<Explanation> calibrate_at_spread_seen(Evidence& evidence) {
    constexpr int rounds = 2;  // what is seen is linear around the fit: the second is nearer to where it ends
    auto calibrated = explain(evidence, {}, nullptr);
    for (int round = 0; round < rounds && calibrated; ++round) {
        take_for_spread(evidence, spread_seen(evidence, calibrated->fit));
        calibrated = polish(evidence, *calibrated);
    }
    return calibrated;
}

/// Calibrates and searches; where what was found leaves the channels wandering further than was allowed for,
/// once more with that allowed for. Leaves in `evidence` what was.
Result<SearchResult> search_at_fidelity_seen(Evidence& evidence, const DiagnoseOptions& options) {
    constexpr int most_rounds = 3;
    constexpr double worth_another = 1.4;
    for (int round = 1;; ++round) {
        auto calibrated = calibrate_at_spread_seen(evidence);
        if (!calibrated) return std::unexpected(calibrated.error());
        auto search = search_effects(evidence, std::move(*calibrated), options);
        if (!search || round == most_rounds) return search;
        const ModelFidelity& fidelity = evidence.calibration.fidelity;
        const double seen = share_of_rise_seen(evidence.run, search->current.fit.point, fidelity);
        if (seen < worth_another * fidelity.share_of_rise) return search;
        allow_for(evidence, seen);
    }
}

/// The models that a file can hold: a sensor has its place in the node there, but no gradient.
struct WrittenModels {
    Model calibrated, extended;
};

Result<WrittenModels> as_written(const Evidence& evidence, const SearchResult& search) {
    Evidence without_gradients = evidence;
    without_gradients.run.gradient_sigma = 1e-6;
    // A search has to be careful with what it calls a disagreement; numbers are the better the nearer the
    // wander is to what is seen.
    allow_for(without_gradients,
              share_of_rise_seen(evidence.run, search.current.fit.point, evidence.calibration.fidelity));
    take_for_spread(without_gradients, spread_seen(evidence, search.current.fit));
    auto calibrated = polish(without_gradients, search.base);
    if (!calibrated) return std::unexpected(calibrated.error());
    const Model before = with_places(calibrated->fit, without_gradients.run);
    if (search.steps.empty()) return WrittenModels{before, before};
    auto extended = polish_thermostats(without_gradients, search.current);
    if (extended) extended = with_expected_sizes(without_gradients, *extended);
    if (!extended) return std::unexpected(extended.error());
    return WrittenModels{before, with_places(extended->fit, without_gradients.run)};
}

/// With the effects as they were described: provenance, how well each number is known.
Model extended_model(Model model, const std::vector<FoundEffect>& effects, std::size_t known) {
    model.effects.resize(known);
    for (const FoundEffect& found : effects) model.effects.push_back(found.effect);
    return model;
}

}  // namespace

std::string_view to_string(GapVerdict verdict) {
    switch (verdict) {
        case GapVerdict::agrees:
            return "agrees";
        case GapVerdict::explained:
            return "explained";
        case GapVerdict::partly_explained:
            return "partly_explained";
        case GapVerdict::unexplained:
            break;
    }
    return "unexplained";
}

Result<Diagnosis> diagnose(const Model& model, const RecordedTest& test, std::span<const Holdout> holdouts,
                           const DiagnoseOptions& options, const ParallelFor& parallel_for) {
    auto evidence = gather(model, test, holdouts, options, parallel_for);
    if (!evidence) return std::unexpected(evidence.error());

    const auto search = search_at_fidelity_seen(*evidence, options);
    if (!search) return std::unexpected(search.error());

    auto written = as_written(*evidence, *search);
    if (!written) return std::unexpected(written.error());
    auto effects = describe_effects(*evidence, *search, written->extended, options);
    if (!effects) return std::unexpected(effects.error());

    Diagnosis diagnosis;
    diagnosis.verdict = verdict_of(*search);
    diagnosis.effects = std::move(*effects);
    diagnosis.calibrated = std::move(written->calibrated);
    diagnosis.extended = extended_model(written->extended, diagnosis.effects, model.effects.size());
    diagnosis.suspects = suspects_of(search->left, options.probability_to_list);
    diagnosis.reason = reason_of(*search, diagnosis);
    diagnosis.share_of_rise = evidence->calibration.fidelity.share_of_rise;
    if (diagnosis.verdict != GapVerdict::agrees) {
        diagnosis.disagreements =
            disagreements_of(evidence->run, search->base.fit.point, evidence->calibration.fidelity);
        diagnosis.residual_heat = residual_heat_of(evidence->run, model, search->first_survey.nameless, 4);
    }
    if (auto done = compare_runs(*evidence, test, holdouts, options, diagnosis); !done)
        return std::unexpected(done.error());
    withdraw_what_closes_no_gap(diagnosis);
    doubt_what_does_not_carry_over(diagnosis);
    return diagnosis;
}

}  // namespace thermbal
