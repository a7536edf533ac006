#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "fit.hpp"
#include "network/simulate.hpp"

namespace thermbal {

/// What switches once on and stays on is another effect: heat that sets in.
inline constexpr std::size_t on_off_on = 3;

/// When the thermostat at a node switched in a simulation, on first.
std::vector<double> moments_at(const Simulation& simulation, const std::string& node);

/// A node's course in a simulation of the model; empty when it cannot be simulated.
Eigen::VectorXd node_course(const Model& model, const Observation& seen, const std::string& node);

/// Mean temperature of the node when it was switched on, and when off.
std::array<double, 2> thresholds_C(const Eigen::VectorXd& node_C, const std::vector<double>& time_s,
                                   const std::vector<double>& moments_s);

/// The thresholds of one thermostat among the coordinates of a fit, moved until it switches when it was seen
/// to.
class ThresholdFit {
  public:
    /// `effect`: among the model's. Moments: on first. All outlive it.
    ThresholdFit(const FitProblem& problem, std::size_t effect, const std::vector<double>& moments_s);

    Eigen::VectorXd placed(Eigen::VectorXd coordinates, double on_C, double hysteresis_C) const;

    /// Gauss-Newton on the moments, the first few, then more: a later one says little until those before it
    /// are right.
    Eigen::VectorXd aligned(Eigen::VectorXd coordinates) const;

  private:
    /// By how much each of the first moments is late; none where there are not that many.
    std::optional<Eigen::VectorXd> late_s(const Eigen::VectorXd& coordinates, std::size_t count) const;
    /// None where no step makes the first moments come closer.
    std::optional<Eigen::VectorXd> stepped(const Eigen::VectorXd& coordinates, std::size_t count) const;

    const FitProblem& problem_;
    const std::vector<double>& moments_s_;
    std::string node_;
    Eigen::Index on_;  ///< coordinate of switch_on_C; that of hysteresis_C is the next
};

}  // namespace thermbal
