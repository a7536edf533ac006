#include "reports.hpp"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace thermbal {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json drive_json(const SimulatorOptions& options) {
    return {{"condition", options.condition},
            {"spindle_rpm", options.drive.spindle_rpm},
            {"cutting", options.drive.cutting},
            {"room_C", options.room.mean_C}};
}

Json heats_json(const std::vector<PlantHeat>& heats, const PlantDescription& plant) {
    Json list = Json::array();
    for (const PlantHeat& heat : heats) {
        list.push_back({{"node", plant.nodes[heat.node].name}, {"power_W", heat.power_W}});
    }
    return list;
}

}  // namespace

std::string truth_table(const SimulatorOptions& options, const Truth& truth) {
    std::string text =
        fmt::format("{}: {} r/min{}, room {:.2f} C\n{:8} {:18} {:>14} {:>22}\n", options.condition,
                    options.drive.spindle_rpm, options.drive.cutting ? ", cutting" : "", options.room.mean_C,
                    "channel", "node", "steady_state_C", "equilibrium_time_min");
    for (const ChannelTruth& channel : truth.channels) {
        const std::string time = std::isfinite(channel.equilibrium_time_min)
                                     ? fmt::format("{:.2f}", channel.equilibrium_time_min)
                                     : "does not rise";
        text += fmt::format("{:8} {:18} {:14.3f} {:>22}\n", channel.channel, channel.node,
                            channel.steady_state_C, time);
    }
    return text;
}

std::string truth_json(const SimulatorOptions& options, const Truth& truth) {
    Json document = drive_json(options);
    document["channels"] = Json::array();
    for (const ChannelTruth& channel : truth.channels) {
        document["channels"].push_back({{"channel", channel.channel},
                                        {"node", channel.node},
                                        {"steady_state_C", channel.steady_state_C},
                                        {"equilibrium_time_min", or_null(channel.equilibrium_time_min)}});
    }
    return document.dump(2) + "\n";
}

std::string plant_json(const SimulatorOptions& options, const PlantDescription& plant) {
    Json document = drive_json(options);
    document["reference_rpm"] = plant.reference_rpm;
    document["walther_a"] = plant.walther_a;
    document["walther_b"] = plant.walther_b;
    for (const PlantNode& node : plant.nodes) {
        document["nodes"].push_back({{"name", node.name},
                                     {"heat_capacity_J_per_K", node.heat_capacity_J_per_K},
                                     {"area_m2", node.area_m2},
                                     {"natural_W_per_m2K125", node.natural_W_per_m2K125},
                                     {"forced_W_per_m2K", node.forced_W_per_m2K},
                                     {"blower_W_per_m2K", node.blower_W_per_m2K},
                                     {"emissivity", node.emissivity}});
    }
    for (const PlantLink& link : plant.links) {
        document["links"].push_back({{"between", {plant.nodes[link.a].name, plant.nodes[link.b].name}},
                                     {"conductance_W_per_K", link.conductance_W_per_K}});
    }
    for (const PlantBearing& bearing : plant.bearings) {
        document["bearings"].push_back({{"node", plant.nodes[bearing.node].name},
                                        {"mean_diameter_mm", bearing.mean_diameter_mm},
                                        {"f0", bearing.f0},
                                        {"load_torque_Nm", bearing.load_torque_Nm}});
    }
    document["running_heat"] = heats_json(plant.running_heat, plant);
    document["cutting_heat"] = heats_json(plant.cutting_heat, plant);
    for (const PlantSensor& sensor : plant.sensors) {
        document["sensors"].push_back(
            {{"channel", sensor.channel},
             {"node", sensor.node == PlantSensor::room ? "room" : plant.nodes[sensor.node].name},
             {"lag_s", sensor.lag_s}});
    }
    return document.dump(2) + "\n";
}

std::string recording_comments(const SimulatorOptions& options) {
    return fmt::format(
        "# thermbal-sim {}: condition {}, {} r/min{}\n"
        "# room {} C, drift {} C/h, cycle {} C each {} min\n"
        "# seed {}, noise {} C, rounding {} C\n",
        THERMBAL_VERSION, options.condition, options.drive.spindle_rpm,
        options.drive.cutting ? ", cutting" : "", options.room.mean_C, options.room.drift_C_per_h,
        options.room.cycle_amplitude_C, options.room.cycle_period_s / 60.0, options.noise.seed,
        options.noise.noise_C, options.noise.round_C);
}

}  // namespace thermbal
