#include "network/effect.hpp"

#include <algorithm>
#include <cmath>

#include "placed_effect.hpp"

namespace thermbal {
namespace {

double prior_unit(PriorUnit unit, const Model& model) {
    const auto geometric_mean = [](const auto& items, auto number) {
        double sum = 0.0;
        for (const auto& item : items) sum += std::log(number(item).value);
        return items.empty() ? 1.0 : std::exp(sum / static_cast<double>(items.size()));
    };
    switch (unit) {
        case PriorUnit::mean_source_power: {
            double sum = 0.0;
            for (const Source& source : model.sources) sum += source.power_W.value;
            if (sum > 0.0) return sum / static_cast<double>(model.sources.size());
            // Without a source: what would warm the machine by about 10 K.
            for (const ThermalLink& link : model.links) {
                if (link.to_ambient()) sum += 10.0 * link.conductance_W_per_K.value;
            }
            return std::max(sum, 1e-3);
        }
        case PriorUnit::mean_conductance:
            return geometric_mean(model.links,
                                  [](const ThermalLink& link) { return link.conductance_W_per_K; });
        case PriorUnit::mean_capacity:
            return geometric_mean(model.nodes, [](const Node& node) { return node.heat_capacity_J_per_K; });
        case PriorUnit::absolute:
            break;
    }
    return 1.0;
}

}  // namespace

std::string_view site_key(EffectSite site) {
    switch (site) {
        case EffectSite::node:
            return "node";
        case EffectSite::source:
            return "source";
        case EffectSite::ambient_link:
            return "link";
        case EffectSite::channel:
            return "channel";
        case EffectSite::column:
            return "column";
        case EffectSite::whole_model:
            break;
    }
    return "";
}

const EffectForm* EffectDefinition::form(std::string_view name) const {
    if (name.empty()) return &forms.front();
    const auto found = std::ranges::find(forms, name, &EffectForm::name);
    return found == forms.end() ? nullptr : &*found;
}

const EffectForm& EffectDefinition::form_of(const Effect& effect) const {
    return *form(effect.form);
}

const EffectForm& form_of(const Effect& effect) {
    return find_effect(effect.kind)->form_of(effect);
}

std::optional<double> onset_of(const Effect& effect) {
    for (const EffectParameterDefinition& parameter : form_of(effect).parameters) {
        if (parameter.is_time && !parameter.when_absent) return effect.parameter(parameter.name);
    }
    return std::nullopt;
}

const EffectDefinition* find_effect(std::string_view kind) {
    const auto found = std::ranges::find(effect_catalogue(), kind, &EffectDefinition::kind);
    return found == effect_catalogue().end() ? nullptr : &*found;
}

std::string node_of_place(EffectSite site, std::string_view at, const Model& model) {
    switch (site) {
        case EffectSite::node:
        case EffectSite::ambient_link:
            return std::string(at);
        case EffectSite::source:
            return model.sources[*find_source(model, at)].node;
        case EffectSite::channel:
            return model.sensors[*find_sensor(model, at)].node;
        case EffectSite::whole_model:
        case EffectSite::column:
            break;
    }
    return "";
}

ResolvedPrior resolve_prior(const EffectParameterDefinition& parameter, const Model& model) {
    const double unit = prior_unit(parameter.prior_unit, model);
    return {.lower = parameter.lower * unit,
            .upper = parameter.upper * unit,
            .centre = parameter.prior_centre * unit,
            .sigma = parameter.logarithmic ? parameter.prior_sigma : parameter.prior_sigma * unit,
            .logarithmic = parameter.logarithmic};
}

Effect make_effect(const EffectDefinition& definition, const EffectForm& form, std::string_view at,
                   const Model& model) {
    Effect effect{.kind = definition.kind,
                  .form = &form == &definition.forms.front() ? "" : form.name,
                  .at = std::string(at),
                  .parameters = {},
                  .provenance = {}};
    for (const EffectParameterDefinition& parameter : form.parameters) {
        if (parameter.when_absent) continue;
        effect.parameters.push_back({parameter.name, resolve_prior(parameter, model).centre, 0.0});
    }
    return effect;
}

std::vector<std::string> possible_places(const EffectForm& form, const Model& model) {
    std::vector<std::string> places;
    switch (form.site) {
        case EffectSite::whole_model:
            places.emplace_back();
            break;
        case EffectSite::node:
            for (const Node& node : model.nodes) places.push_back(node.name);
            break;
        case EffectSite::source:
            for (const Source& source : model.sources) places.push_back(source.name);
            break;
        case EffectSite::ambient_link:
            for (const ThermalLink& link : model.links) {
                if (link.to_ambient()) places.push_back(link.surface_node());
            }
            break;
        case EffectSite::channel:
            for (const Sensor& sensor : model.sensors) {
                if (sensor.node != ambient_node) places.push_back(sensor.channel);
            }
            break;
        case EffectSite::column:
            break;
    }
    return places;
}

std::vector<double> effect_values(const EffectDefinition& definition, const Effect& effect) {
    std::vector<double> values;
    for (const EffectParameterDefinition& parameter : definition.form_of(effect).parameters) {
        const double value = effect.parameter(parameter.name);
        values.push_back(std::isnan(value) ? parameter.when_absent.value_or(parameter.prior_centre) : value);
    }
    return values;
}

PlacedEffect place(const EffectDefinition& definition, const Effect& effect, const Model& model,
                   std::span<const double> values) {
    const EffectForm& form = definition.form_of(effect);
    PlacedEffect placed{.form = static_cast<std::size_t>(&form - definition.forms.data()),
                        .at = 0,
                        .at_name = effect.at,
                        .values = values};
    switch (form.site) {
        case EffectSite::node:
        case EffectSite::ambient_link:
            placed.at = *find_node(model, effect.at);
            break;
        case EffectSite::source:
            placed.at = *find_source(model, effect.at);
            break;
        case EffectSite::channel:
            placed.at = *find_sensor(model, effect.at);
            break;
        case EffectSite::whole_model:
        case EffectSite::column:
            break;
    }
    return placed;
}

}  // namespace thermbal
