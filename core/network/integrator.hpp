#pragma once

#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "base/error.hpp"
#include "heat_flow.hpp"
#include "modal_system.hpp"
#include "network/simulate.hpp"
#include "sensor_chain.hpp"

namespace thermbal {

/// Integrates a compiled network from its initial temperatures through the sample times.
///
/// Between two moments of the grid (samples, jumps of inputs, breaks) the linear part is exact in modal
/// coordinates. Heat that is constant in a step enters exactly, too; what varies with time or temperature is
/// integrated by the third-order exponential Runge-Kutta method ETD3RK (Cox, Matthews, J. Comput. Phys. 176,
/// 2002), halving the step until its difference to the embedded second-order step is within the tolerance.
/// Thermostats switch at the moment of their crossing.
class Integrator {
  public:
    using AtSample = std::function<void(std::size_t sample, const Eigen::VectorXd& node_C, double ambient_C)>;

    /// All outlive it.
    Integrator(const CompiledNetwork& network, InputSchedule& schedule, SensorChain& sensors,
               const SimulationOptions& options);

    /// Calls `at_sample` at every sample time. Error (stop): the temperatures run away, or switch without
    /// end.
    Result<void> run(const Eigen::VectorXd& initial_C, std::span<const double> sample_times_s,
                     const AtSample& at_sample);
    int steps() const { return steps_; }
    const std::vector<ThermostatSwitching>& switchings() const { return switchings_; }

  private:
    /// The factors of a step of h_s, per mode.
    struct StepFactors {
        double h_s = 0.0;
        Eigen::ArrayXd decay, decay_half, half, whole, second, begin, middle, end;
    };

    std::vector<double> grid(std::span<const double> sample_times_s) const;
    void enter_regime(std::size_t regime);
    const StepFactors& factors(double h_s);
    double longest_step_s() const;
    /// Heat is constant between two moments of the grid, and no sensor asks what happens between them.
    bool is_exact_throughout() const;
    /// Such a network: every interval one exact step, the nodes' temperatures of all samples at once.
    Result<void> run_exact(std::span<const double> sample_times_s, std::span<const double> moments,
                           const AtSample& at_sample);
    /// What happened at the moments of the grid so far: nodes x moments.
    struct ExactRun {
        Eigen::MatrixXd node_C;
        std::vector<double> ambient_C;
    };
    /// One regime of it, from node_C_ at the first of its moments to the last.
    void exact_regime(std::span<const double> moments, ExactRun& run);
    Result<void> advance(double from_s, double to_s);
    /// A step from the state modal_ at from_s into next_modal_ and next_C_; returns its estimated error.
    double try_step(double from_s, double h_s);
    void exact_step(double h_s);
    double smooth_step(double from_s, double h_s);
    void modal_heat(double time_s, const Eigen::VectorXd& node_C, Eigen::VectorXd& modal_heat);
    void accept(double from_s, double h_s);

    /// By how much a node is past where its thermostat switches next; the second: of all thermostats.
    double past_threshold_C(std::size_t thermostat, const Eigen::VectorXd& node_C) const;
    double furthest_past_threshold_C(const Eigen::VectorXd& node_C) const;
    /// The largest part of the step that no thermostat's switching lies in; leaves that step in next_*.
    double shorten_to_switching(double from_s, double h_s);
    void switch_thermostats(double time_s);

    const CompiledNetwork& network_;
    HeatFlow heat_;
    SensorChain& sensors_;
    SimulationOptions options_;
    double start_s_;
    std::vector<double> breaks_s_;
    std::vector<NetworkRegime> regimes_;
    const ModalSystem* system_ = nullptr;
    std::vector<StepFactors> known_factors_;
    std::size_t oldest_factors_ = 0;

    Eigen::VectorXd node_C_, modal_, next_C_, next_modal_;
    Eigen::VectorXd heat_W_, begin_, middle_, end_, stage_C_, from_slope_, to_slope_;
    int steps_ = 0;
    std::vector<ThermostatSwitching> switchings_;
    int halvings_ = 0;  ///< of the present step, against the interval of the grid
};

}  // namespace thermbal
