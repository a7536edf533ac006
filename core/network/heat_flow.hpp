#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "input_schedule.hpp"
#include "network_builder.hpp"

namespace thermbal {

/// The heat that enters every node beside what the linear part carries: sources, the ambient behind the
/// surfaces, and whatever effects add. Used for one run from its beginning to its end.
class HeatFlow {
  public:
    /// Both outlive it.
    HeatFlow(const CompiledNetwork& network, InputSchedule& schedule);

    /// Before every step: what is constant in it. No jump or break lies inside the step.
    void begin_step(double from_s, double to_s);
    void switch_thermostat(std::size_t thermostat, bool on) { thermostat_on_[thermostat] = on; }
    bool thermostat_on(std::size_t thermostat) const { return thermostat_on_[thermostat]; }

    /// The heat flows (W) at a moment of the step. `surface_W_per_K` is what the linear part holds.
    void evaluate(double time_s, const Eigen::VectorXd& node_C, const Eigen::VectorXd& surface_W_per_K,
                  Eigen::VectorXd& heat_W) const;
    double ambient_C(double time_s) const;

  private:
    void add_sources(const NetworkState& state, Eigen::VectorXd& heat_W) const;
    void add_surfaces(double ambient_C, const Eigen::VectorXd& node_C, const Eigen::VectorXd& surface_W_per_K,
                      Eigen::VectorXd& heat_W) const;

    const CompiledNetwork& network_;
    InputSchedule& schedule_;
    /// What a column's value makes of a source's power, kept as long as the value stays.
    struct Powered {
        double value = std::numeric_limits<double>::quiet_NaN();
        double share = 0.0;
    };
    std::vector<double> drive_;
    std::vector<Powered> powered_;
    std::vector<char> thermostat_on_;
    double step_middle_s_ = 0.0;
    double room_C_ = 0.0;
};

}  // namespace thermbal
