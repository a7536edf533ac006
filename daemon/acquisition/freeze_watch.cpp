#include "acquisition/freeze_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace thermbal {
namespace {

constexpr double chance_of_module = 1e-9;
constexpr double chance_of_channels = 1e-7;
// Fewer scans are no run; over more of them what the newest ones showed need not hold on.
constexpr std::int64_t shortest_run = 4;
constexpr std::int64_t longest_run = 60;
// A warm-up slows down while it is learnt from: what was frequent an hour ago says little. A time constant of
// 10 min are 40 scans.
constexpr double newest_scans = 12.0;
constexpr double lately_scans = 60.0;
constexpr double module_scans = 200.0;
// A word that goes to and fro between two neighbours stands on the edge between them. A channel may leave its
// edge at any time and be still until the next one, however long it has flickered.
constexpr double leaves_its_edge = 0.05;
// All channels on an edge at once, and then none of them, is no chance: so many of them have to say so.
constexpr double edge_channels = 0.6;

bool are_neighbours(std::uint32_t a, std::uint32_t b) {
    return a - b == 1U || b - a == 1U;
}

}  // namespace

void FreezeWatch::Share::add(double unseen_scans, bool seen_at_last, double memory_scans) {
    const double kept = std::pow(1.0 - 1.0 / memory_scans, unseen_scans + 1.0);
    scans = kept * scans + unseen_scans + 1.0;
    seen = kept * seen + (seen_at_last ? 1.0 : 0.0);
}

double FreezeWatch::Share::surprise() const {
    // With two scans without it taken for granted: nothing known yet means that it need never be seen.
    return -std::log((scans - seen + 2.0) / (scans + 2.0));
}

void FreezeWatch::Frequency::add(double unseen_scans, bool seen_at_last) {
    newest.add(unseen_scans, seen_at_last, newest_scans);
    lately.add(unseen_scans, seen_at_last, lately_scans);
}

FreezeWatch::FreezeWatch(std::vector<WatchedModule> modules) {
    for (WatchedModule& module : modules) {
        State state;
        state.channels.resize(module.channels.size());
        state.module = std::move(module);
        states_.push_back(std::move(state));
    }
}

FreezeWatch::Seen FreezeWatch::compare(State& state, const Scan& scan) {
    Seen seen = Seen::nothing;
    int changed = 0;
    bool neighbours = true;
    for (std::size_t i = 0; i < state.channels.size(); ++i) {
        Channel& channel = state.channels[i];
        const auto& word = scan.samples[state.module.channels[i]].raw;
        channel.changed = word && channel.word && *channel.word != *word;
        channel.third = channel.changed && channel.former && channel.former != word;
        if (!word) continue;
        if (channel.changed) {
            seen = Seen::a_change;
            ++changed;
            neighbours = neighbours && are_neighbours(*word, *channel.word);
            channel.former = channel.word;
        } else if (channel.word && seen == Seen::nothing) {
            seen = Seen::the_same;
        }
        channel.word = word;
    }
    state.one_step = changed == 1 && neighbours;
    return seen;
}

/// -ln of the chance that all of them are still for as long as they are. A third word says that noise or
/// trend is wider than a step: such a channel has no edge to leave.
double FreezeWatch::surprise_of_channels(const State& state, Share Frequency::* memory) {
    const double most_on_an_edge = std::min(
        -std::log(leaves_its_edge),
        -std::log(chance_of_channels) / (edge_channels * static_cast<double>(state.channels.size())));
    const auto run = static_cast<double>(state.run);
    double sum = 0.0;
    for (const Channel& channel : state.channels)
        sum += std::max(std::min(most_on_an_edge, run * (channel.changes.*memory).surprise()),
                        run * (channel.third_words.*memory).surprise());
    return sum;
}

bool FreezeWatch::too_long_for_chance(const State& state) {
    if (state.run >= state.module.frozen_after_scans) return true;
    if (state.run < shortest_run || state.run > longest_run) return false;
    // As a whole as well: a module that converts slower than it is read changes all its words at once.
    return static_cast<double>(state.run) * state.changes.surprise() >= -std::log(chance_of_module) &&
           surprise_of_channels(state, &Frequency::newest) >= -std::log(chance_of_channels) &&
           surprise_of_channels(state, &Frequency::lately) >= -std::log(chance_of_channels);
}

/// The caller knows which module it is.
std::optional<FreezeChange> FreezeWatch::judge(State& state, Seen seen, std::int64_t scan) {
    if (seen == Seen::the_same) {
        if (state.run++ == 0) state.run_first_scan = scan;
        if (state.frozen || !too_long_for_chance(state)) return std::nullopt;
        state.frozen = true;
        return FreezeChange{.module = 0, .frozen = true, .first_scan = state.run_first_scan};
    }
    // What a frozen module repeats says nothing of how it measures. One that comes back by one step of one
    // channel was not frozen: it had nothing else to say.
    const bool was_alive = !state.frozen || state.one_step;
    const double repeated = was_alive ? static_cast<double>(state.run) : 0.0;
    state.changes.add(repeated, true, module_scans);
    for (Channel& channel : state.channels) {
        channel.changes.add(repeated, channel.changed);
        channel.third_words.add(repeated, channel.third);
    }
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
