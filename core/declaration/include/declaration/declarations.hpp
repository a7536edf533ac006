#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "declaration/verdict.hpp"

namespace thermbal {

/// What became of a channel from one window to the next.
struct DeclarationChange {
    enum class Kind { declared, withdrawn };
    Kind kind = Kind::declared;
    std::string channel;
    std::string reason;
};

/// The declarations of a test so far. A declaration stands with the figures of the window that it was made
/// on, until later samples contradict it: the machine's regime changed after it, or what is known now
/// excludes what was declared then. It is then withdrawn, and the channel is measured on.
class Declarations {
  public:
    /// Takes the fresh verdicts of one window. `regime_since_min`: when the regime that the window is in
    /// began, on the test's time; a declaration from before it does not stand.
    std::vector<DeclarationChange> update(const std::vector<ChannelVerdict>& fresh, double regime_since_min);

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
