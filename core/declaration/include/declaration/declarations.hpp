#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "declaration/verdict.hpp"

namespace thermbal {

/// What became of a channel from one window to the next.
struct DeclarationChange {
    enum class Kind { declared, renewed, withdrawn };
    Kind kind = Kind::declared;
    std::string channel;
    std::string reason;
};
std::string_view to_string(DeclarationChange::Kind kind);

/// Whether figures that a later window knows better are replaced: while a test waits for its other channels.
/// Afterwards what it was stopped on is to be compared with what then happens.
enum class Renewals { wanted, over };

/// The declarations of a test so far. A declaration stands with the figures of the window that it was made
/// on, until later samples contradict it:
/// - the machine's inputs changed or the room jumped after it: withdrawn, and the channel is measured on. A
///   room that drifts is no such change: a steady state is said for the room of its window;
/// - a later window, whose interval is within the tolerance and leaves out the declared steady state, is off
///   from it by more than the tolerance: renewed with the figures of that window where all guards but the
///   sweep pass on it (what the sweep said of the declaration it keeps), else withdrawn;
/// - a later interval and the declared one are apart, the room's move taken out: withdrawn.
class Declarations {
  public:
    /// Takes the fresh verdicts of one window. `last_change_min`: of the inputs or the room, on the test's
    /// time; a declaration from before it does not stand.
    std::vector<DeclarationChange> update(const std::vector<ChannelVerdict>& fresh, double last_change_min,
                                          Renewals renewals = Renewals::wanted);

    /// Declarations that an earlier life of the daemon made and stored.
    void restore(std::vector<ChannelVerdict> declared);

    /// The channels whose declaration stands.
    std::set<std::string> declared_channels() const;

    /// The standing declarations and, of the other channels, the latest verdicts; in the order of the last
    /// update.
    const std::vector<ChannelVerdict>& standing() const { return standing_; }

  private:
    std::vector<ChannelVerdict> standing_;
};

}  // namespace thermbal
