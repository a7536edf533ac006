#include "simulator/spindle_head.hpp"

namespace thermbal {
namespace {

enum Body : std::size_t {
    shaft_front,
    shaft_rear,
    front_bearing,
    rear_bearing,
    sleeve_front,
    sleeve_rear,
    nose_cover,
    headstock_front,
    headstock_middle,
    headstock_rear,
    headstock_top,
    headstock_bottom,
    motor_stator,
    motor_housing,
    motor_flange,
    guideway,
    column_upper,
    column_middle,
    column_lower,
    bed,
    table,
};

/// name, heat capacity J/K, area m2, natural, forced at 5000 r/min, blower, emissivity; in the order of Body.
std::vector<PlantNode> bodies() {
    return {
        {"shaft_front", 3900, 0.02, 0.0, 45.182, 0.0, 0.3},
        {"shaft_rear", 2900, 0.03, 0.0, 45.182, 0.0, 0.3},
        {"front_bearing", 1000, 0.0, 0.0, 0.0, 0.0, 0.0},
        {"rear_bearing", 600, 0.0, 0.0, 0.0, 0.0, 0.0},
        {"sleeve_front", 6000, 0.0, 0.0, 0.0, 0.0, 0.0},
        {"sleeve_rear", 4500, 0.0, 0.0, 0.0, 0.0, 0.0},
        {"nose_cover", 1500, 0.06, 1.5, 28.239, 0.0, 0.3},
        {"headstock_front", 7403.5, 0.22, 1.5, 6.777, 0.0, 0.9},
        {"headstock_middle", 7951.9, 0.20, 1.5, 5.648, 0.0, 0.9},
        {"headstock_rear", 6855.1, 0.22, 1.5, 5.648, 0.0, 0.9},
        {"headstock_top", 4716.3, 0.25, 1.7, 6.777, 0.0, 0.9},
        {"headstock_bottom", 4716.3, 0.20, 0.8, 6.777, 0.0, 0.9},
        {"motor_stator", 6300, 0.0, 0.0, 0.0, 0.0, 0.0},
        {"motor_housing", 6500, 0.35, 1.5, 0.0, 12.0, 0.9},
        {"motor_flange", 4000, 0.08, 1.5, 3.389, 0.0, 0.9},
        {"guideway", 12000, 0.10, 1.5, 2.259, 0.0, 0.8},
        {"column_upper", 43000, 0.75, 1.4, 2.259, 0.0, 0.9},
        {"column_middle", 50000, 0.90, 1.4, 0.0, 0.0, 0.9},
        {"column_lower", 56000, 1.40, 1.4, 0.0, 0.0, 0.9},
        {"bed", 160000, 2.50, 1.2, 0.0, 0.0, 0.9},
        {"table", 32000, 1.10, 1.4, 0.0, 0.0, 0.6},
    };
}

std::vector<PlantLink> joints() {
    return {
        {front_bearing, shaft_front, 12},
        {front_bearing, sleeve_front, 18},
        {rear_bearing, shaft_rear, 8},
        {rear_bearing, sleeve_rear, 12},
        {shaft_front, shaft_rear, 3},
        {sleeve_front, sleeve_rear, 6},
        {shaft_front, nose_cover, 1},
        {nose_cover, sleeve_front, 4},
        {nose_cover, headstock_front, 5},
        {sleeve_front, headstock_front, 22},
        {sleeve_rear, headstock_rear, 16},
        {sleeve_front, headstock_middle, 6},
        {sleeve_rear, headstock_middle, 6},
        {headstock_front, headstock_middle, 14},
        {headstock_middle, headstock_rear, 14},
        {headstock_front, headstock_top, 8},
        {headstock_middle, headstock_top, 6},
        {headstock_rear, headstock_top, 8},
        {headstock_front, headstock_bottom, 8},
        {headstock_middle, headstock_bottom, 6},
        {headstock_rear, headstock_bottom, 8},
        {motor_stator, motor_housing, 15},
        {motor_stator, motor_flange, 6},
        {motor_housing, motor_flange, 8},
        {motor_flange, headstock_rear, 18},
        {motor_stator, shaft_rear, 1},
        {headstock_middle, guideway, 6},
        {guideway, column_upper, 8},
        {column_upper, column_middle, 12},
        {column_middle, column_lower, 12},
        {column_lower, bed, 15},
        {bed, table, 6},
    };
}

std::vector<PlantSensor> sensors() {
    return {
        {"T1", PlantSensor::room, 60.0}, {"T2", front_bearing, 12.0},   {"T3", rear_bearing, 12.0},
        {"T4", sleeve_front, 15.0},      {"T5", headstock_front, 20.0}, {"T6", sleeve_rear, 15.0},
        {"T7", headstock_middle, 20.0},  {"T8", headstock_rear, 20.0},  {"T9", headstock_top, 25.0},
        {"T10", headstock_bottom, 25.0}, {"T11", motor_housing, 30.0},  {"T12", motor_flange, 20.0},
        {"T13", nose_cover, 30.0},       {"T14", guideway, 20.0},       {"T15", column_upper, 35.0},
        {"T16", column_middle, 35.0},
    };
}

}  // namespace

PlantDescription spindle_head() {
    PlantDescription head;
    head.nodes = bodies();
    head.links = joints();
    head.bearings = {{front_bearing, 82.0, 0.45, 0.135694}, {rear_bearing, 70.0, 0.40, 0.0791546}};
    // Magnetising loss: the same at every speed of the idling motor.
    head.running_heat = {{motor_stator, 114.5525}};
    // Most cutting heat leaves with the chips; what stays enters where chips and feed drives are.
    head.cutting_heat = {{shaft_front, 8.0},  {nose_cover, 3.0},       {motor_stator, 26.8058},
                         {guideway, 49.8107}, {column_upper, 66.4142}, {column_middle, 49.8107},
                         {table, 40.0}};
    head.sensors = sensors();
    // Base oil of a spindle grease: 22 mm2/s at 40 C, 4.3 mm2/s at 100 C.
    head.walther_a = 9.567331259715619;
    head.walther_b = 3.780448424367959;
    return head;
}

const std::vector<Condition>& conditions() {
    static const std::vector<Condition> all = {
        {"5000-idle", {5000.0, false}, 18.0, 26.7, 126.25},
        {"3000-idle", {3000.0, false}, 18.0, 24.8, 150.25},
        {"3000-cutting", {3000.0, true}, 18.0, 27.4, 170.0},
    };
    return all;
}

std::optional<Condition> find_condition(std::string_view name) {
    for (const Condition& condition : conditions()) {
        if (condition.name == name) return condition;
    }
    return std::nullopt;
}

}  // namespace thermbal
