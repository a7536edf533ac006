#include "network_builder.hpp"

#include <utility>

#include <fmt/format.h>

namespace thermbal {
namespace {

std::size_t index_of(const Model& model, std::string_view node) {
    return node == ambient_node ? ambient_index : *find_node(model, node);
}

}  // namespace

NetworkBuilder::NetworkBuilder(const Model& model, InputSchedule& schedule) : schedule_(schedule) {
    for (const Node& node : model.nodes) {
        network_.node_names.push_back(node.name);
        network_.capacity_J_per_K.push_back(node.heat_capacity_J_per_K.value);
    }
    network_.surface_W_per_K.assign(model.nodes.size(), 0.0);
    for (const ThermalLink& link : model.links) {
        const double conductance = link.conductance_W_per_K.value;
        if (link.to_ambient())
            network_.surface_W_per_K[index_of(model, link.surface_node())] += conductance;
        else
            network_.links.push_back({index_of(model, link.a), index_of(model, link.b), conductance});
    }
    for (const Source& source : model.sources) {
        const std::size_t driven_by = source.proportional_to.empty()
                                          ? no_column
                                          : use_column(source.proportional_to, "the source " + source.name);
        network_.sources.push_back({index_of(model, source.node), source.power_W.value, driven_by,
                                    source.reference, source.exponent.value});
    }
    for (const Sensor& sensor : model.sensors) {
        network_.sensors.push_back({.node = index_of(model, sensor.node), .time_constant_s = 0.0});
    }
    network_.ambient_C = model.ambient.value_C;
    if (!model.ambient.column.empty()) {
        network_.ambient_column = use_column(model.ambient.column, "the ambient");
    }
}

std::size_t NetworkBuilder::use_column(std::string_view name, std::string_view wanted_by) {
    const auto found = schedule_.use(name);
    if (found) return *found;
    if (missing_.empty()) {
        missing_ =
            fmt::format("the inputs have no column {} with a number in it; {} needs it", name, wanted_by);
    }
    return no_column;
}

void NetworkBuilder::add_heat(std::size_t node, StateFunction power_W, Variation variation) {
    network_.heat_terms.push_back({node, std::move(power_W)});
    network_.smooth |= variation == Variation::smooth;
}

void NetworkBuilder::multiply_source(std::size_t source, StateFunction factor) {
    network_.source_factors.push_back({source, std::move(factor)});
    network_.smooth = true;
}

void NetworkBuilder::stop_sources(double from_s, double to_s) {
    network_.stops_s.emplace_back(from_s, to_s);
    add_break(from_s);
    add_break(to_s);
}

void NetworkBuilder::add_node_behind(std::size_t node, double capacity_J_per_K, double conductance_W_per_K) {
    network_.links.push_back({node, network_.node_names.size(), conductance_W_per_K});
    network_.node_names.push_back(network_.node_names[node] + ".slow_structure");
    network_.capacity_J_per_K.push_back(capacity_J_per_K);
    network_.surface_W_per_K.push_back(0.0);
}

void NetworkBuilder::change_surface(const SurfaceChange& change) {
    network_.surface_changes.push_back(change);
    add_break(change.from_s);
}

void NetworkBuilder::multiply_surfaces(std::function<double(double)> factor) {
    network_.surface_factors.emplace_back(std::move(factor));
    network_.smooth = true;
}

void NetworkBuilder::shift_ambient(StateFunction added_C, Variation variation) {
    network_.ambient_shifts.push_back(std::move(added_C));
    network_.smooth |= variation == Variation::smooth;
}

void NetworkBuilder::follow_column(std::string_view column, double share) {
    network_.followed_column = use_column(column, "ambient_drift");
    network_.followed_share = share;
}

void NetworkBuilder::lag_sensor(std::size_t sensor, double time_constant_s) {
    network_.sensors[sensor].time_constant_s += time_constant_s;
}

void NetworkBuilder::add_to_reading(std::size_t sensor, std::function<double(double)> added_C) {
    network_.reading_terms.push_back({sensor, std::move(added_C)});
}

void NetworkBuilder::detach_sensor(const Detachment& detachment) {
    network_.detachments.push_back(detachment);
    add_break(detachment.from_s);
}

std::vector<std::pair<std::size_t, double>> NetworkBuilder::links_of(std::size_t node) const {
    std::vector<std::pair<std::size_t, double>> found;
    for (const CompiledLink& link : network_.links) {
        if (link.a == node) found.emplace_back(link.b, link.conductance_W_per_K);
        if (link.b == node) found.emplace_back(link.a, link.conductance_W_per_K);
    }
    return found;
}

Result<CompiledNetwork> NetworkBuilder::finish() && {
    if (!missing_.empty()) return fail(NextStep::refuse_input, std::move(missing_));
    return std::move(network_);
}

}  // namespace thermbal
