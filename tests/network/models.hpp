#pragma once

#include <string>
#include <vector>

#include "network/simulate.hpp"

namespace thermbal::testing {

inline std::vector<double> every(double step_s, double until_s) {
    std::vector<double> times;
    for (double k = 0.0; k * step_s <= until_s; k += 1.0) times.push_back(k * step_s);
    return times;
}

inline void add_node(Model& model, const std::string& name, double capacity_J_per_K) {
    model.nodes.push_back({name, {capacity_J_per_K, 0.3}});
}
inline void add_link(Model& model, const std::string& a, const std::string& b, double conductance_W_per_K) {
    model.links.push_back({a, b, {conductance_W_per_K, 0.3}});
}
inline void add_source(Model& model, const std::string& node, double power_W,
                       const std::string& column = "") {
    model.sources.push_back({node, node, {power_W, 0.3}, column, 5000.0, {1.0, 0.0}});
}
inline void add_sensor(Model& model, const std::string& channel, const std::string& node) {
    model.sensors.push_back({channel, node, 0.05});
}

/// One mass in a room of 20 C.
inline Model one_node(double capacity_J_per_K, double conductance_W_per_K, double power_W) {
    Model model;
    model.ambient.value_C = 20.0;
    add_node(model, "body", capacity_J_per_K);
    add_link(model, "body", "ambient", conductance_W_per_K);
    if (power_W > 0.0) add_source(model, "body", power_W);
    add_sensor(model, "T2", "body");
    return model;
}

/// A spindle head of four masses, two sources (one with the speed), a sensor on three of them and one in the
/// room.
inline Model spindle_head() {
    Model model;
    model.name = "a spindle head";
    model.ambient.value_C = 20.0;
    add_node(model, "bearing", 2500.0);
    add_node(model, "sleeve", 6000.0);
    add_node(model, "housing", 22000.0);
    add_node(model, "motor", 9000.0);
    add_link(model, "bearing", "sleeve", 11.0);
    add_link(model, "sleeve", "housing", 14.0);
    add_link(model, "motor", "housing", 6.0);
    add_link(model, "bearing", "ambient", 0.8);
    add_link(model, "housing", "ambient", 5.0);
    add_link(model, "motor", "ambient", 2.0);
    add_source(model, "bearing", 95.0, "spindle_rpm");
    add_source(model, "motor", 60.0);
    add_sensor(model, "T1", "ambient");
    add_sensor(model, "T2", "bearing");
    add_sensor(model, "T3", "housing");
    add_sensor(model, "T4", "motor");
    return model;
}

/// Two speeds and a rest; first readings that are not in equilibrium; a room channel that moves.
inline Inputs spindle_inputs() {
    Inputs inputs;
    inputs.time_s = {0.0, 1500.0, 3000.0, 4210.0, 6000.0};
    inputs.columns = {{"spindle_rpm", {5000.0, 5000.0, 3000.0, 0.0, 6000.0}},
                      {"T1", {20.0, 20.6, 21.1, 20.9, 21.5}}};
    inputs.first_readings = {{"T1", 20.0}, {"T2", 22.5}, {"T3", 21.0}, {"T4", 20.4}};
    return inputs;
}

}  // namespace thermbal::testing
