#pragma once

#include <cstddef>
#include <vector>

#include "mode.hpp"

namespace thermbal {

/// Up to `lanes` channels side by side. Those that are missing have a scale of 1 and zeros besides.
struct ChannelGroup {
    static constexpr std::size_t lanes = 16;

    std::size_t channels = 0;
    std::size_t points = 0;
    std::vector<double> gram;       ///< points x points x lanes
    std::vector<double> projected;  ///< points x lanes
    std::vector<double> scale;
    std::vector<double> log_scale_squared;
};

/// The log marginal likelihood of all channels given their modes, the amplitudes marginalised. The chain asks
/// for nothing else: channels stand side by side, sixteen at a time, and each counts as it would alone.
/// Thread-safe.
class ModeLikelihood {
  public:
    /// The most modes `log_at` takes.
    static constexpr std::size_t most_modes = 24;

    /// `channels`, one or more, share the grid and the direction.
    ModeLikelihood(const std::vector<WhitenedChannel>& channels, const ModePrior& prior);

    /// Up to a constant.
    double log_at(const std::vector<Mode>& modes) const;

  private:
    const ModePrior& prior_;
    std::size_t points_;
    double direction_;
    std::vector<ChannelGroup> groups_;
};

}  // namespace thermbal
