#include "acquisition/freeze_watch.hpp"

#include <cmath>
#include <utility>

namespace thermbal {
namespace {

constexpr double memory_scans = 200.0;
constexpr double chance = 1e-9;
constexpr std::int64_t shortest_run = 4;

}  // namespace

FreezeWatch::FreezeWatch(std::vector<WatchedModule> modules) {
    for (WatchedModule& module : modules) {
        State state;
        state.words.resize(module.channels.size());
        state.module = std::move(module);
        states_.push_back(std::move(state));
    }
}

FreezeWatch::Seen FreezeWatch::compare(State& state, const Scan& scan) {
    Seen seen = Seen::nothing;
    for (std::size_t i = 0; i < state.words.size(); ++i) {
        const auto& word = scan.samples[state.module.channels[i]].raw;
        if (!word) continue;
        if (state.words[i] && *state.words[i] != *word) {
            seen = Seen::a_change;
        } else if (state.words[i] && seen == Seen::nothing) {
            seen = Seen::the_same;
        }
        state.words[i] = word;
    }
    return seen;
}

bool FreezeWatch::too_long_for_chance(const State& state) {
    if (state.run >= state.module.frozen_after_scans) return true;
    // With two unchanged scans taken for granted: nothing known yet means that nothing need ever change.
    const double unchanged_share = (state.unchanged + 2.0) / (state.scans + 2.0);
    return state.run >= shortest_run &&
           static_cast<double>(state.run) * std::log(unchanged_share) <= std::log(chance);
}

/// The caller knows which module it is.
std::optional<FreezeChange> FreezeWatch::judge(State& state, Seen seen, std::int64_t scan) {
    if (seen == Seen::the_same) {
        if (state.run++ == 0) state.run_first_scan = scan;
        if (state.frozen || !too_long_for_chance(state)) return std::nullopt;
        state.frozen = true;
        return FreezeChange{.module = 0, .frozen = true, .first_scan = state.run_first_scan};
    }
    // What a frozen module repeats says nothing of how it measures.
    const double repeated = state.frozen ? 0.0 : static_cast<double>(state.run);
    const double kept = std::pow(1.0 - 1.0 / memory_scans, repeated + 1.0);
    state.scans = kept * state.scans + repeated + 1.0;
    state.unchanged = kept * state.unchanged + repeated;
    state.run = 0;
    if (!std::exchange(state.frozen, false)) return std::nullopt;
    return FreezeChange{.module = 0, .frozen = false, .first_scan = scan};
}

void FreezeWatch::begin_grid() {
    for (State& state : states_) state.run_first_scan = 0;
}

std::vector<FreezeChange> FreezeWatch::take(Scan& scan) {
    std::vector<FreezeChange> changes;
    for (std::size_t m = 0; m < states_.size(); ++m) {
        State& state = states_[m];
        const Seen seen = compare(state, scan);
        if (seen != Seen::nothing) {
            if (auto change = judge(state, seen, scan.scan)) {
                change->module = m;
                changes.push_back(*change);
            }
        }
        if (!state.frozen) continue;
        for (const std::size_t channel : state.module.channels) {
            Sample& sample = scan.samples[channel];
            if (sample.good()) sample = {.raw = sample.raw, .value_C = no_value, .quality = Quality::stuck};
        }
    }
    return changes;
}

}  // namespace thermbal
