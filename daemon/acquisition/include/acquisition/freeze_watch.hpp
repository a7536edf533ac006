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
/// before, for longer than chance allows. How likely a scan without any change is, is learnt from the
/// module's last 200 scans; frozen is what would be seen by chance once in 10^9 scans, or frozen_after_scans.
/// A module that never changed yet is not judged by chance. Event loop only.
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
    struct State {
        WatchedModule module;
        std::vector<std::optional<std::uint32_t>> words;  ///< newest ones, by position in module.channels
        double scans = 0.0;                               ///< compared lately
        double unchanged = 0.0;                           ///< of these
        std::int64_t run = 0;                             ///< unchanged scans in a row
        std::int64_t run_first_scan = 0;
        bool frozen = false;
    };
    enum class Seen : std::uint8_t { nothing, a_change, the_same };

    static Seen compare(State& state, const Scan& scan);
    static bool too_long_for_chance(const State& state);
    static std::optional<FreezeChange> judge(State& state, Seen seen, std::int64_t scan);

    std::vector<State> states_;
};

}  // namespace thermbal
