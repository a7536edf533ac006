#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace thermbal {

/// Lumped bodies of a machine. Heat leaves a body's surface by natural convection (coefficient times
/// |dT|^(1/4), flat plate), by air that moving parts drive along it (at `reference_rpm`, growing with
/// speed^(2/3): turbulent rotating surface), by a blower that always runs, and by radiation to the room.
struct PlantNode {
    std::string name;
    double heat_capacity_J_per_K = 0.0;
    double area_m2 = 0.0;
    double natural_W_per_m2K125 = 0.0;
    double forced_W_per_m2K = 0.0;
    double blower_W_per_m2K = 0.0;
    double emissivity = 0.0;
};

struct PlantLink {
    std::size_t a = 0;
    std::size_t b = 0;
    double conductance_W_per_K = 0.0;
};

/// Palmgren's friction: a load torque that does not depend on speed, and a viscous torque
/// 1e-7 f0 (nu n)^(2/3) d^3 (N mm; nu in mm2/s, n in r/min, d in mm) with the oil's viscosity at the bearing.
struct PlantBearing {
    std::size_t node = 0;
    double mean_diameter_mm = 0.0;
    double f0 = 0.0;
    double load_torque_Nm = 0.0;
};

struct PlantHeat {
    std::size_t node = 0;
    double power_W = 0.0;
};

/// A first-order sensor on a body, or in the room's air.
struct PlantSensor {
    static constexpr std::size_t room = static_cast<std::size_t>(-1);
    std::string channel;
    std::size_t node = room;
    double lag_s = 20.0;
};

struct PlantDescription {
    std::vector<PlantNode> nodes;
    std::vector<PlantLink> links;
    std::vector<PlantBearing> bearings;
    std::vector<PlantHeat> running_heat;  ///< while the spindle turns
    std::vector<PlantHeat> cutting_heat;  ///< in addition, while it cuts
    std::vector<PlantSensor> sensors;
    double reference_rpm = 5000.0;
    /// Walther's equation of the base oil, nu in mm2/s, T in K: log10 log10(nu + 0.7) = a - b log10 T.
    double walther_a = 0.0;
    double walther_b = 0.0;
};

struct Drive {
    double spindle_rpm = 0.0;
    bool cutting = false;
};

/// The room's air: constant, plus a ramp, plus a sine, from plant time 0 on.
struct Room {
    double mean_C = 18.0;
    double drift_C_per_h = 0.0;
    double cycle_amplitude_C = 0.0;
    double cycle_period_s = 1200.0;

    double at(double time_s) const;
};

double oil_viscosity_mm2_per_s(const PlantDescription& plant, double temperature_C);
double friction_W(const PlantDescription& plant, const PlantBearing& bearing, double temperature_C,
                  double rpm);

/// Heat that each node receives from friction, motor and cutting, W.
std::vector<double> heat_sources_W(const PlantDescription& plant, const std::vector<double>& node_C,
                                   const Drive& drive);
/// Heat that each node gives to the room, W.
std::vector<double> heat_losses_W(const PlantDescription& plant, const std::vector<double>& node_C,
                                  double room_C, const Drive& drive);
/// What remains in each node: sources - losses + conduction, W. Zero everywhere at the steady state.
std::vector<double> heat_balance_W(const PlantDescription& plant, const std::vector<double>& node_C,
                                   double room_C, const Drive& drive);

/// A plant in time. It starts at plant time 0 with everything at the room's temperature; time only goes
/// forward.
class Plant {
  public:
    Plant(PlantDescription description, Room room, Drive drive);

    /// Integrates (classical Runge-Kutta, steps of at most `max_step_s`, well below the fastest time
    /// constant) up to `time_s`; an earlier time is left alone.
    void advance_to(double time_s);
    void set_drive(const Drive& drive) { drive_ = drive; }

    double time_s() const { return time_s_; }
    const Drive& drive() const { return drive_; }
    const Room& room() const { return room_; }
    const PlantDescription& description() const { return description_; }
    std::vector<double> node_C() const;
    /// What the sensors feel, after their lag, without noise; in the order of description().sensors.
    std::vector<double> sensor_C() const;

    static constexpr double max_step_s = 1.0;

  private:
    std::vector<double> derivative(double time_s, const std::vector<double>& state) const;

    PlantDescription description_;
    Room room_;
    Drive drive_;
    double time_s_ = 0.0;
    std::vector<double> state_;  ///< nodes, then sensors, C
};

}  // namespace thermbal
