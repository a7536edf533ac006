#include "network/model.hpp"

#include <algorithm>
#include <limits>

namespace thermbal {
namespace {

template <typename Items, typename Name>
std::optional<std::size_t> position(const Items& items, std::string_view name, Name member) {
    const auto found = std::ranges::find(items, name, member);
    if (found == items.end()) return std::nullopt;
    return static_cast<std::size_t>(found - items.begin());
}

}  // namespace

double Effect::parameter(std::string_view parameter_name) const {
    const auto found = std::ranges::find(parameters, parameter_name, &EffectParameter::name);
    return found == parameters.end() ? std::numeric_limits<double>::quiet_NaN() : found->value;
}

void Effect::set_parameter(std::string_view parameter_name, double value) {
    const auto found = std::ranges::find(parameters, parameter_name, &EffectParameter::name);
    if (found == parameters.end())
        parameters.push_back({std::string(parameter_name), value, 0.0});
    else
        found->value = value;
}

std::optional<std::size_t> find_node(const Model& model, std::string_view name) {
    return position(model.nodes, name, &Node::name);
}

std::optional<std::size_t> find_source(const Model& model, std::string_view name) {
    return position(model.sources, name, &Source::name);
}

std::optional<std::size_t> find_sensor(const Model& model, std::string_view channel) {
    return position(model.sensors, channel, &Sensor::channel);
}

std::optional<std::size_t> find_ambient_link(const Model& model, std::string_view surface_node) {
    const auto found = std::ranges::find_if(model.links, [&](const ThermalLink& link) {
        return link.to_ambient() && link.surface_node() == surface_node;
    });
    if (found == model.links.end()) return std::nullopt;
    return static_cast<std::size_t>(found - model.links.begin());
}

std::vector<std::string> neighbours(const Model& model, std::string_view node) {
    std::vector<std::string> names;
    for (const ThermalLink& link : model.links) {
        if (link.to_ambient()) continue;
        if (link.a == node) names.push_back(link.b);
        if (link.b == node) names.push_back(link.a);
    }
    return names;
}

}  // namespace thermbal
