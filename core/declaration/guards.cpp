#include "guards.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/median.hpp"
#include "series/resolution.hpp"
#include "series/sample.hpp"

namespace thermbal {
namespace {

const ChannelEstimate* estimate_of(const SpectrumEstimate* estimate, const std::string& channel) {
    if (estimate == nullptr) return nullptr;
    const auto found = std::ranges::find(estimate->channels, channel, &ChannelEstimate::channel);
    return found == estimate->channels.end() ? nullptr : &*found;
}

/// What a sensor said until it fell silent is no ground for a declaration now.
Guard newest_sample_is_fresh(const GuardEvidence& evidence, const GuardOptions& options) {
    const std::vector<double>& values = evidence.samples.values;
    std::size_t missing = 0;
    while (missing < values.size() && !std::isfinite(values[values.size() - 1 - missing])) ++missing;
    const double age_min = static_cast<double>(missing) * evidence.window.period_s / 60.0;
    return {"newest_sample_is_fresh", age_min <= options.newest_sample_min,
            fmt::format("{:.1f} min without a good sample (allowed {:.0f} min)", age_min,
                        options.newest_sample_min)};
}

Guard no_recent_change(const GuardEvidence& evidence, const GuardOptions& options) {
    const bool ever =
        evidence.regime.last_change_s > evidence.window.start_s || !evidence.regime.began_with.empty();
    const double since_min = (evidence.window.end_s() - evidence.regime.last_change_s) / 60.0;
    return {"no_recent_change", !ever || since_min >= options.after_change_min,
            ever ? fmt::format("{:.1f} min since the last change of speed or room (needed {:.0f} min)",
                               since_min, options.after_change_min)
                 : std::string("one regime")};
}

/// How far the room is now from where it just was: mean of the last 2 min against the median of the 10 min
/// before. nullopt where there are not the samples to say.
std::optional<double> room_step_C(std::span<const double> room_C, std::size_t end, double period_s) {
    const auto recent = static_cast<std::size_t>(120.0 / period_s),
               before = static_cast<std::size_t>(600.0 / period_s);
    if (recent == 0 || end < recent + before) return std::nullopt;
    const double now_C = mean_of_good(room_C.subspan(end - recent, recent));
    std::vector<double> then_C;
    for (const double value : room_C.subspan(end - recent - before, before)) {
        if (std::isfinite(value)) then_C.push_back(value);
    }
    if (then_C.empty() || !std::isfinite(now_C)) return std::nullopt;
    return std::abs(now_C - upper_median(std::move(then_C)));
}

/// A door that has just opened is not found as a change yet; the room's sensor shows it within two minutes.
/// Against what is usual in this room, so that an air conditioner that cycles does not hold every channel for
/// ever.
Guard room_is_quiet(const GuardEvidence& evidence, const FlowOptions& options) {
    Guard guard{"room_is_quiet", true, "no step of the room"};
    const Column* room = options.ambient.empty() ? nullptr : evidence.window.channel(options.ambient);
    if (room == nullptr) return guard;
    const auto now_C = room_step_C(room->values, room->values.size(), evidence.window.period_s);
    if (!now_C) return guard;
    std::vector<double> earlier_C;
    const auto minute = static_cast<std::size_t>(std::max(1.0, 60.0 / evidence.window.period_s));
    for (std::size_t end = room->values.size(); end > 15 * minute;) {
        end -= minute;
        if (room->values.size() - end < 12 * minute) continue;
        if (const auto step_C = room_step_C(room->values, end, evidence.window.period_s))
            earlier_C.push_back(*step_C);
    }
    double usual_C = 0.0;
    if (!earlier_C.empty()) {
        const auto rank =
            earlier_C.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(earlier_C.size() - 1));
        std::ranges::nth_element(earlier_C, rank);
        usual_C = *rank;
    }
    const double allowed_C =
        std::max(options.guards.room_step_C, options.guards.room_step_over_usual * usual_C);
    guard.passed = *now_C <= allowed_C;
    guard.figures = fmt::format("the room is {:.2f} C from where it was 10 min ago (allowed {:.2f} C)",
                                *now_C, allowed_C);
    return guard;
}

Guard enough_samples(const GuardEvidence& evidence, const GuardOptions& options) {
    const double window_min = (evidence.window.end_s() - evidence.window.start_s) / 60.0;
    const auto good =
        std::ranges::count_if(evidence.samples.values, [](double value) { return std::isfinite(value); });
    const double share = evidence.window.scans == 0
                             ? 0.0
                             : static_cast<double>(good) / static_cast<double>(evidence.window.scans);
    return {
        "enough_samples", window_min >= options.shortest_window_min && share >= options.good_share,
        fmt::format("{:.1f} min{}, {:.0f} % of the samples good (needed {:.0f} min, {:.0f} %)", window_min,
                    evidence.regime.began_with.empty() ? "" : " since " + evidence.regime.began_with,
                    100.0 * share, options.shortest_window_min, 100.0 * options.good_share)};
}

/// What a channel that rises by tens of kelvin must be known to is a share of its rise, not 0.2 C.
double tolerance_of(const ChannelEstimate& now, const FlowOptions& options) {
    return std::max(options.tolerance_C, options.tolerance_share_of_rise * std::abs(now.rise_C));
}

Guard interval_within_tolerance(const ChannelEstimate& now, const FlowOptions& options) {
    const double half_C = 0.5 * (now.steady_state_high_C - now.steady_state_low_C);
    const double allowed_C = tolerance_of(now, options);
    return {"interval_within_tolerance", half_C <= allowed_C,
            fmt::format("settles at {:.2f} C within +-{:.2f} C at 90 % (needed +-{:.2f} C)",
                        now.steady_state_C, half_C, allowed_C)};
}

/// Above the room: a room that cycles moves every steady state, and no prediction is to blame.
Guard stable_over_windows(const ChannelEstimate& now, const GuardEvidence& evidence,
                          const FlowOptions& options) {
    double low_C = now.steady_state_C - evidence.now->ambient_tail_C;
    double high_C = low_C;
    std::size_t seen = 0;
    for (const SpectrumEstimate* shorter : evidence.shorter) {
        const ChannelEstimate* before = estimate_of(shorter, now.channel);
        if (before == nullptr) continue;
        const double above_room_C = before->steady_state_C - shorter->ambient_tail_C;
        low_C = std::min(low_C, above_room_C);
        high_C = std::max(high_C, above_room_C);
        ++seen;
    }
    const double allowed_C = options.guards.drift_in_tolerances * tolerance_of(now, options);
    return {"stable_over_windows", seen == 2 && high_C - low_C <= allowed_C,
            seen < 2
                ? std::string("no earlier windows to compare with yet")
                : fmt::format("the prediction moved by {:.2f} C over the last {:.0f} min (allowed {:.2f} C)",
                              high_C - low_C, 2.0 * options.guards.look_back_min, allowed_C)};
}

Guard slowest_seen_long_enough(const ChannelEstimate& now, const GuardEvidence& evidence,
                               const GuardOptions& options) {
    // A channel that rises little may hide its share of the machine's slowest mode in the noise.
    const double slowest_min =
        std::max(now.slowest_time_constant_min,
                 options.share_of_machines_slowest * evidence.now->slowest_time_constant_min);
    const double seen_min = (evidence.window.end_s() - evidence.window.start_s) / 60.0;
    const double needed_min = slowest_min * (now.used_responses ? options.slow_time_constants_archived
                                                                : options.slow_time_constants);
    return {"slowest_seen_long_enough", seen_min >= needed_min,
            fmt::format("{:.0f} min seen, slowest time constant {:.0f} min (needed {:.0f} min)", seen_min,
                        slowest_min, needed_min)};
}

/// A sensor far from the heat goes its way late: while most of it is still to come, its slow share is the
/// prior's word and not the data's (on the finite-volume machines 4 % of such declarations were wrong, of the
/// others 0.8 %). Of the machine's own heat: what the room does is measured.
Guard most_of_the_rise_seen(const ChannelEstimate& now, const FlowOptions& options) {
    const double share = 1.0 - now.own_to_come_C() / now.own_rise_C();
    const bool barely = std::abs(now.own_rise_C()) <= options.tolerance_C;
    return {"most_of_the_rise_seen", barely || share >= options.guards.share_of_rise,
            fmt::format("{:.0f} % of its way is seen (needed {:.0f} %)", 100.0 * share,
                        100.0 * options.guards.share_of_rise)};
}

Guard physical(const ChannelEstimate& now, const GuardOptions& options) {
    const double direction = now.own_rise_C() >= now.own_to_come_C() ? 1.0 : -1.0;
    return {"physical", direction * now.own_to_come_C() >= -options.overshoot_C,
            fmt::format("from {:.2f} C now to {:.2f} C, of it {:.2f} C after the room", now.last_C,
                        now.steady_state_C, now.room_to_come_C)};
}

/// The first scan of the run of identical readings at the end of a channel; missing samples do not end it.
std::size_t start_of_last_run(std::span<const double> values) {
    const double last = last_good(values);
    std::size_t start = values.size();
    for (std::size_t i = values.size(); i-- > 0;) {
        if (!std::isfinite(values[i])) continue;
        if (values[i] != last) break;
        start = i;
    }
    return start;
}

/// How far the channels have moved since a scan: the median of them, so that no single one says so.
double median_move_C(const TestWindow& window, std::size_t since) {
    std::vector<double> moved_C;
    for (const Column& column : window.channels) {
        const std::span<const double> rest = std::span(column.values).subspan(since);
        const auto then = std::ranges::find_if(rest, [](double value) { return std::isfinite(value); });
        if (then != rest.end()) moved_C.push_back(std::abs(last_good(rest) - *then));
    }
    return moved_C.empty() ? 0.0 : upper_median(std::move(moved_C));
}

/// Readings that jump by two steps of the resolution and more from one to the next cannot be the same for
/// long, wherever between two steps the temperature rests.
bool noise_shows(std::span<const double> readings_C) {
    constexpr double share_of_jumps = 0.05;
    const double jump_C = 1.5 * smallest_step(readings_C);
    std::size_t jumps = 0;
    std::size_t pairs = 0;
    for (std::size_t i = 1; i < readings_C.size(); ++i) {
        const double change_C = std::abs(readings_C[i] - readings_C[i - 1]);
        if (!std::isfinite(change_C)) continue;
        ++pairs;
        if (change_C > jump_C) ++jumps;
    }
    return jump_C > 0.0 && static_cast<double>(jumps) > share_of_jumps * static_cast<double>(pairs);
}

/// The very same reading while the other channels warm, or where its own noise has shown before: a sensor or
/// an input that does not measure any more.
bool is_stuck(const GuardEvidence& evidence, const GuardOptions& options) {
    const std::span<const double> values = evidence.samples.values;
    const std::size_t start = start_of_last_run(values);
    const std::span<const double> run = values.subspan(start);
    const double long_scans = options.stuck_min * 60.0 / evidence.window.period_s;
    const auto readings = std::ranges::count_if(run, [](double value) { return std::isfinite(value); });
    if (static_cast<double>(readings) < options.good_share * long_scans ||
        static_cast<double>(run.size()) < long_scans)
        return false;
    return median_move_C(evidence.window, start) >= options.stuck_rise_C ||
           (static_cast<double>(start) >= long_scans && noise_shows(values.first(start)));
}

}  // namespace

Regime current_regime(const TestWindow& window, const FlowOptions& options) {
    if (window.scans > options.longest_window_scans)
        return current_regime(coarsened(window, options.longest_window_scans), options);
    const RegimeReport report = find_regime_changes(window, options.ambient, options.regime);
    Regime regime{window.start_s, "", report.last_change_s, {}, {}};
    for (const RegimeChange& change : report.changes) {
        if (!change.restarts_window) continue;
        regime.since_s = report.usable_from_s;
        regime.began_with = fmt::format("the {} at {:.1f} min", to_string(change.kind), change.time_s / 60.0);
    }
    regime.window = window_from(window, regime.since_s);
    if (regime.began_with.empty()) return regime;
    constexpr std::size_t first_scans = 4;
    for (const Column& column : window.channels)
        regime.start_level_C.push_back(
            mean_of_good(std::span(column.values).first(std::min(first_scans, column.values.size()))));
    return regime;
}

ChannelVerdict begin_verdict(const Column& column, double window_end_min) {
    ChannelVerdict verdict;
    verdict.channel = column.name;
    verdict.window_end_min = window_end_min;
    verdict.value_C = last_good(column.values);
    return verdict;
}

void ask_samples(ChannelVerdict& verdict, const GuardEvidence& evidence, const FlowOptions& options) {
    const bool any_good =
        std::ranges::any_of(evidence.samples.values, [](double value) { return std::isfinite(value); });
    const auto scans = static_cast<std::size_t>(options.guards.stuck_min * 60.0 / evidence.window.period_s);
    const std::size_t first =
        evidence.samples.values.size() > scans ? evidence.samples.values.size() - scans : 0;
    const bool recent_good = std::ranges::any_of(std::span(evidence.samples.values).subspan(first),
                                                 [](double value) { return std::isfinite(value); });
    verdict.guards.push_back({"alive", any_good && recent_good,
                              any_good && recent_good ? std::string("good readings")
                                                      : fmt::format("no good reading in the last {:.0f} min",
                                                                    options.guards.stuck_min)});
    if (!verdict.guards.back().passed) verdict.state = ChannelState::dead;
    const bool stuck = is_stuck(evidence, options.guards);
    verdict.guards.push_back(
        {"follows_the_machine", !stuck,
         stuck ? fmt::format(
                     "the very same reading for {:.0f} min or more, while the machine warms or against its "
                     "own noise before",
                     options.guards.stuck_min)
               : std::string("its readings change")});
    if (stuck) verdict.state = ChannelState::stuck;
    verdict.guards.push_back(enough_samples(evidence, options.guards));
    verdict.guards.push_back(newest_sample_is_fresh(evidence, options.guards));
    verdict.guards.push_back(no_recent_change(evidence, options.guards));
    verdict.guards.push_back(room_is_quiet(evidence, options));
}

void take_estimate(ChannelVerdict& verdict, const GuardEvidence& evidence, const FlowOptions& options) {
    const ChannelEstimate* now = estimate_of(evidence.now, verdict.channel);
    if (now == nullptr) return;
    verdict.steady_state_C = now->steady_state_C;
    verdict.steady_state_low_C = now->steady_state_low_C;
    verdict.steady_state_high_C = now->steady_state_high_C;
    verdict.tolerance_C = tolerance_of(*now, options);
    if (evidence.now->has_ambient) verdict.room_C = evidence.now->ambient_tail_C;
    verdict.equilibrium_time_min = now->equilibrium_time_min;
    verdict.equilibrium_time_low_min = now->equilibrium_low_min;
    verdict.equilibrium_time_high_min = now->equilibrium_high_min;
}

void ask_shared_modes(ChannelVerdict& verdict, const GuardEvidence& evidence, const FlowOptions& options) {
    const ChannelEstimate* now = estimate_of(evidence.now, verdict.channel);
    if (now == nullptr) {
        verdict.guards.push_back(
            {"interval_within_tolerance", false, "the shared time constants are not known yet"});
        return;
    }
    verdict.guards.push_back(interval_within_tolerance(*now, options));
    verdict.guards.push_back(stable_over_windows(*now, evidence, options));
    verdict.guards.push_back(slowest_seen_long_enough(*now, evidence, options.guards));
    verdict.guards.push_back(most_of_the_rise_seen(*now, options));
    verdict.guards.push_back(physical(*now, options.guards));
    const bool known = first_failed(verdict.guards) == nullptr;
    const double most_C = std::max(std::abs(now->rise_C), std::abs(now->own_rise_C()));
    if (known && most_C <= options.guards.barely_rise_in_tolerances * options.tolerance_C) {
        verdict.state = ChannelState::barely_warming;
    }
}

void ask_sweep(ChannelVerdict& verdict, const Result<ChannelSweep>& swept, const FlowOptions& options) {
    if (!swept) {
        verdict.guards.push_back({"clear_minimum", false, swept.error().message});
        return;
    }
    verdict.rmse_by_n_C = swept->rmse_by_n_C;
    verdict.n = swept->minimum.n;
    verdict.window_rmse_C = swept->minimum.n > 0 ? swept->minimum.rmse_C : no_value;
    verdict.svr = swept->svr;
    verdict.guards.push_back(swept->minimum.guard);
    if (options.guards.svr_agreement_C > 0.0) {
        const double apart_C = std::abs(swept->svr.steady_state_C - verdict.steady_state_C);
        verdict.guards.push_back({"estimators_agree", apart_C <= options.guards.svr_agreement_C,
                                  fmt::format("SVR {:.2f} C, shared modes {:.2f} C",
                                              swept->svr.steady_state_C, verdict.steady_state_C)});
    }
}

void conclude(ChannelVerdict& verdict, double window_end_min, const FlowOptions& /*options*/) {
    const Guard* failed = first_failed(verdict.guards);
    if (verdict.state != ChannelState::measuring) {
        verdict.reason =
            fmt::format("{}: {}", to_string(verdict.state),
                        failed != nullptr ? failed->figures : "its whole rise is within the tolerance");
        return;
    }
    if (failed != nullptr) {
        verdict.reason = fmt::format("{}: {}", failed->name, failed->figures);
        return;
    }
    verdict.state = ChannelState::declared;
    verdict.declared_at_min = window_end_min;
    verdict.stands_since_min = window_end_min;
    verdict.reason = "declared";
}

}  // namespace thermbal
