#include "carry_over.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/ranges.h>

#include "network/effect.hpp"

namespace thermbal {
namespace {

/// Below this a held-out run is as good as before.
constexpr double much_worse = 1.05;

/// Nats of a run's own readings that are enough to say that it is described better; of the held-out runs,
/// where numbers that the run did not tell say more. A share of the one adds to a share of the other. With 20
/// and 40 twice as many effect-free runs have a name (README.md).
constexpr double enough_of_the_run = 60.0, enough_of_holdouts = 100.0;

/// What imitates the error of a sensor is where it sits in its node, of which the model knows little; what
/// imitates an effect of the machine are its numbers, which have been free to. Of 210 effect-free runs none
/// had such a name that this share would have kept (README.md).
constexpr double share_asked_of_the_machine = 1.0 / 6.0;

/// Of the effects named right 225 nats and more were the run's where the held-out gap grew all the same.
constexpr double enough_where_holdouts_grow = 3.0 * enough_of_the_run;

/// In these channels; in all where there are none.
double log_likelihood_gained(const RunComparison& run, const std::vector<std::string>& channels) {
    double gained = 0.0;
    for (Eigen::Index c = 0; c < run.channel_before_rmse_C.size(); ++c) {
        const std::string& channel = run.channels[static_cast<std::size_t>(c)];
        if (!channels.empty() && std::ranges::find(channels, channel) == channels.end()) continue;
        const auto readings = static_cast<double>(run.measured_C.col(c).array().isFinite().count());
        if (readings == 0.0) continue;
        gained += readings * std::log(run.channel_before_rmse_C(c) / run.channel_after_rmse_C(c));
    }
    return gained;
}

/// Sums over the held-out runs, before and after.
struct SquaredGaps {
    double before = 0.0, after = 0.0;
};

SquaredGaps squared_gaps(const std::vector<RunComparison>& runs) {
    SquaredGaps sum;
    for (const RunComparison& run : runs) {
        sum.before += run.before_rmse_C * run.before_rmse_C;
        sum.after += run.after_rmse_C * run.after_rmse_C;
    }
    return sum;
}

/// None where channels that gain something hide that the gap as a whole is no smaller.
double log_likelihood_gained(const std::vector<RunComparison>& runs,
                             const std::vector<std::string>& channels) {
    const SquaredGaps gaps = squared_gaps(runs);
    if (gaps.after >= gaps.before) return 0.0;
    double gained = 0.0;
    for (const RunComparison& run : runs) gained += log_likelihood_gained(run, channels);
    return std::max(0.0, gained);
}

bool makes_holdouts_much_worse(const Diagnosis& diagnosis) {
    const SquaredGaps gaps = squared_gaps(diagnosis.holdouts);
    return gaps.after > much_worse * much_worse * gaps.before;
}

bool is_of_sensor(const FoundEffect& found) {
    return form_of(found.effect).site == EffectSite::channel;
}

/// The error of a sensor shows in its own channel. What other channels gain by one is that numbers moved with
/// it.
std::vector<std::string> where_it_has_to_show(const std::vector<FoundEffect>& effects) {
    std::vector<std::string> channels;
    if (!std::ranges::all_of(effects, is_of_sensor)) return channels;
    for (const FoundEffect& found : effects) channels.push_back(found.at);
    return channels;
}

/// Whether what was found closes enough of the gaps to be named.
bool closes_a_gap(const Diagnosis& diagnosis) {
    if (makes_holdouts_much_worse(diagnosis)) {
        const bool any_is_sure = !std::ranges::all_of(diagnosis.effects, &FoundEffect::in_doubt);
        return any_is_sure && log_likelihood_gained(diagnosis.run, {}) >= enough_where_holdouts_grow;
    }
    const std::vector<std::string> channels = where_it_has_to_show(diagnosis.effects);
    const double of_the_run = log_likelihood_gained(diagnosis.run, channels);
    const double of_holdouts = log_likelihood_gained(diagnosis.holdouts, channels);
    const bool any_of_sensor = std::ranges::any_of(diagnosis.effects, is_of_sensor);
    return of_the_run / enough_of_the_run + of_holdouts / enough_of_holdouts >=
           (any_of_sensor ? 1.0 : share_asked_of_the_machine);
}

void forget_effects(RunComparison& run) {
    run.after_C = run.before_C;
    run.after_rmse_C = run.before_rmse_C;
    run.channel_after_rmse_C = run.channel_before_rmse_C;
}

}  // namespace

void withdraw_what_closes_no_gap(Diagnosis& diagnosis) {
    if (diagnosis.effects.empty() || closes_a_gap(diagnosis)) return;
    std::vector<Suspect> withdrawn;
    std::vector<std::string> places;
    for (const FoundEffect& found : diagnosis.effects) {
        withdrawn.push_back({found.effect.kind, found.at, found.probability, 0.0});
        places.push_back(fmt::format("{} at {}", found.effect.kind, found.at));
    }
    diagnosis.suspects.insert(diagnosis.suspects.begin(), withdrawn.begin(), withdrawn.end());
    const bool left_something = diagnosis.verdict == GapVerdict::partly_explained;
    diagnosis.effects.clear();
    diagnosis.extended = diagnosis.calibrated;
    diagnosis.verdict = left_something ? GapVerdict::unexplained : GapVerdict::agrees;
    if (!left_something) {
        diagnosis.disagreements.clear();
        diagnosis.residual_heat.clear();
    }
    diagnosis.reason =
        fmt::format("{}what was found does not describe the runs better, so that it is not named: {}",
                    left_something ? "something is missing; " : "", fmt::join(places, ", "));
    forget_effects(diagnosis.run);
    for (RunComparison& held : diagnosis.holdouts) forget_effects(held);
}

void doubt_what_does_not_carry_over(Diagnosis& diagnosis) {
    if (diagnosis.effects.empty() || !makes_holdouts_much_worse(diagnosis)) return;
    const auto [before, after] = squared_gaps(diagnosis.holdouts);
    for (FoundEffect& found : diagnosis.effects) found.probability *= before / after;
    if (diagnosis.verdict == GapVerdict::explained) diagnosis.verdict = GapVerdict::partly_explained;
    const auto runs = static_cast<double>(diagnosis.holdouts.size());
    diagnosis.reason += fmt::format(
        "; but the held-out gap grows with them from {:.3f} to {:.3f} C, so the names are doubtful: see the "
        "alternatives",
        std::sqrt(before / runs), std::sqrt(after / runs));
}

}  // namespace thermbal
