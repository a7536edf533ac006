#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "network_builder.hpp"

namespace thermbal {

/// The ends of one step, and how fast the nodes under a lagging sensor move there.
struct StepEnds {
    double from_s;
    double to_s;
    const Eigen::VectorXd& from_C;
    const Eigen::VectorXd& to_C;
    const Eigen::VectorXd& from_slope_C_per_s;
    const Eigen::VectorXd& to_slope_C_per_s;
    double from_ambient_C;
    double to_ambient_C;
};

/// From node temperatures to what the sensors read: a share of the air, the lag, what is added.
class SensorChain {
  public:
    explicit SensorChain(const CompiledNetwork& network);

    bool needs_slopes() const { return needs_slopes_; }
    /// Those under a lagging sensor, each once.
    const std::vector<Eigen::Index>& lagged_nodes() const { return lagged_nodes_; }
    /// Every lagging sensor has come to rest.
    void begin(double time_s, const Eigen::VectorXd& node_C, double ambient_C);
    void advance(const StepEnds& step);
    double read(std::size_t sensor, double time_s, const Eigen::VectorXd& node_C, double ambient_C) const;

  private:
    double ambient_share(std::size_t sensor, double time_s) const;
    double measured(std::size_t sensor, double share, const Eigen::VectorXd& node_values,
                    double ambient_value) const;

    /// Of a sensor's lag over a step of h_s, kept because most steps are as long as the one before.
    struct Decay {
        double h_s = 0.0;
        std::array<double, 5> phi{};
    };

    const CompiledNetwork& network_;
    std::vector<double> lagged_C_;
    std::vector<Decay> decays_;
    std::vector<Eigen::Index> lagged_nodes_;
    bool needs_slopes_ = false;
};

}  // namespace thermbal
