#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/scan.hpp"

namespace thermbal {

/// One module, as far as it is configured.
struct WatchedModule {
    std::string name;
    std::vector<std::size_t> channels;
    std::int64_t frozen_after_scans =
        120;  ///< unchanged for so long is frozen, whatever the module did before
};

/// What FreezeWatch found out at a scan.
struct FreezeChange {
    std::size_t module = 0;
    bool frozen = true;           ///< false: its words change again
    std::int64_t first_scan = 0;  ///< of the frozen words: what was read from here on is the same word again
};

/// Notices a module that answers and measures no more: every word of all its channels the same as the scan
/// before, for longer than a live module would show it even while its temperatures settle: chance once in
/// 10^9, for the module as a whole and for its channels together (README), or frozen_after_scans. What is
/// likely is learnt from the newest scans. A module that never changed yet is not judged by chance. Event
/// loop only.
class FreezeWatch {
  public:
    explicit FreezeWatch(std::vector<WatchedModule> modules);

    /// Marks the samples of frozen modules in `scan` stuck (their raw word stays). Scans rise; a scan in
    /// which a module said nothing tells nothing of it.
    std::vector<FreezeChange> take(Scan& scan);

    /// Scans are counted from 0 again.
    void begin_grid();

    const WatchedModule& module(std::size_t index) const { return states_[index].module; }

  private:
    /// How often something is seen: counts in which older scans fade.
    struct Share {
        double scans = 0.0;
        double seen = 0.0;

        void add(double unseen_scans, bool seen_at_last, double memory_scans);
        /// -ln of the chance that it is not seen in a scan.
        double surprise() const;
    };
    /// In the newest scans, and in some more.
    struct Frequency {
        Share newest;
        Share lately;

        void add(double unseen_scans, bool seen_at_last);
    };
    struct Channel {
        std::optional<std::uint32_t> word;    ///< the newest one
        std::optional<std::uint32_t> former;  ///< the last other one before it
        bool changed = false;                 ///< at this scan
        bool third = false;                   ///< ... to another word than the former one
        Frequency changes;
        Frequency third_words;
    };
    struct State {
        WatchedModule module;
        std::vector<Channel> channels;  ///< by position in module.channels
        Share changes;                  ///< of any channel
        std::int64_t run = 0;           ///< unchanged scans in a row
        std::int64_t run_first_scan = 0;
        bool one_step = false;  ///< this scan's change is one step of one channel
        bool frozen = false;
    };
    enum class Seen : std::uint8_t { nothing, a_change, the_same };

    static Seen compare(State& state, const Scan& scan);
    static double surprise_of_channels(const State& state, Share Frequency::* memory);
    static bool too_long_for_chance(const State& state);
    static std::optional<FreezeChange> judge(State& state, Seen seen, std::int64_t scan);

    std::vector<State> states_;
};

}  // namespace thermbal
