#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "mode_sampler.hpp"

namespace thermbal {

/// The log marginal likelihood of all channels given their modes, the amplitudes marginalised. The chain asks
/// for nothing else: channels stand side by side, sixteen at a time, and each counts as it would alone.
/// Thread-safe.
class ModeLikelihood {
  public:
    /// The most modes `log_at` takes.
    static constexpr std::size_t most_modes = 24;
    static constexpr std::size_t lanes = 16;

    /// `channels`, one or more, share the grid and the direction.
    ModeLikelihood(const std::vector<WhitenedChannel>& channels, const ModePrior& prior);

    /// Up to a constant.
    double log_at(const std::vector<Mode>& modes) const;

  private:
    /// Up to `lanes` channels; those that are missing are all zeros and count nothing.
    struct Group {
        std::size_t channels = 0;
        std::vector<double> gram;       ///< grid x grid x lanes
        std::vector<double> projected;  ///< grid x lanes
        std::vector<double> scale_squared;
        std::vector<double> signed_scale;
        std::vector<double> log_scale_squared;
    };

    const ModePrior& prior_;
    std::size_t points_;
    double direction_;
    std::vector<Group> groups_;
};

/// Where a mode lies on a grid of the prior.
struct GridCell {
    Eigen::Index below = 0;
    double share = 0.0;  ///< of the next point
};

GridCell cell_of(double position, Eigen::Index points);

double interpolate(const Eigen::VectorXd& values, double position);

}  // namespace thermbal
