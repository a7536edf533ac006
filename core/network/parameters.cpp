#include "network/parameters.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "network/effect.hpp"

namespace thermbal {
namespace {

/// ln of a number known to a relative sigma has this standard deviation, if it is log-normal.
double log_sigma(double relative_sigma) {
    return std::sqrt(std::log1p(relative_sigma * relative_sigma));
}
double relative_from_log(double sigma) {
    return std::sqrt(std::expm1(sigma * sigma));
}

Parameter base_parameter(std::string name, const Uncertain& number) {
    const double sigma = log_sigma(number.relative_sigma);
    // Beyond five sigmas the prior has said no; at least a factor of 1.5 keeps a solver off its bounds.
    const double reach = std::exp(std::max(5.0 * sigma, 0.4));
    return {.name = std::move(name),
            .value = number.value,
            .lower = number.value / reach,
            .upper = number.value * reach,
            .logarithmic = true,
            .prior_centre = number.value,
            .prior_sigma = sigma};
}

Parameter ambient_parameter(const Ambient& ambient) {
    const double reach = 6.0 * ambient.sigma_C;
    return {.name = "ambient_C",
            .value = ambient.value_C,
            .lower = ambient.value_C - reach,
            .upper = ambient.value_C + reach,
            .logarithmic = false,
            .prior_centre = ambient.value_C,
            .prior_sigma = ambient.sigma_C};
}

/// An earlier fit's sigma is in the parameter's unit; a logarithmic coordinate has it relative to the value.
Parameter effect_parameter(const Model& model, std::size_t index, const EffectParameterDefinition& definition,
                           const EffectParameter& given) {
    const Effect& effect = model.effects[index];
    const ResolvedPrior prior = resolve_prior(definition, model);
    Parameter parameter{.name = fmt::format("{}({}).{}", effect.kind, effect.at, given.name),
                        .value = given.value,
                        .lower = std::min(prior.lower, given.value),
                        .upper = std::max(prior.upper, given.value),
                        .logarithmic = prior.logarithmic,
                        .prior_centre = prior.centre,
                        .prior_sigma = prior.sigma,
                        .is_time = definition.is_time,
                        .of_effect = true,
                        .effect = index};
    if (given.sigma > 0.0) {
        parameter.prior_centre = given.value;
        parameter.prior_sigma = prior.logarithmic ? log_sigma(given.sigma / given.value) : given.sigma;
    }
    return parameter;
}

/// Calls the function for every number that a fit may move, in the order of parameters_of. Models may be
/// const.
template <typename AnyModel, typename OnUncertain, typename OnAmbient, typename OnEffect>
void for_each_number(AnyModel& model, OnUncertain on_uncertain, OnAmbient on_ambient, OnEffect on_effect) {
    const auto maybe = [&](auto& number, auto make_name) {
        if (number.relative_sigma > 0.0) on_uncertain(number, make_name);
    };
    for (auto& node : model.nodes) {
        maybe(node.heat_capacity_J_per_K, [&] { return node.name + ".heat_capacity_J_per_K"; });
    }
    for (auto& link : model.links) {
        maybe(link.conductance_W_per_K, [&] { return link.a + "-" + link.b + ".conductance_W_per_K"; });
    }
    for (auto& source : model.sources) {
        maybe(source.power_W, [&] { return source.name + ".power_W"; });
        maybe(source.exponent, [&] { return source.name + ".exponent"; });
    }
    if (model.ambient.column.empty() && model.ambient.sigma_C > 0.0) on_ambient(model.ambient);
    for (std::size_t i = 0; i < model.effects.size(); ++i) {
        for (auto& parameter : model.effects[i].parameters) on_effect(i, parameter);
    }
}

}  // namespace

std::vector<Parameter> parameters_of(const Model& model) {
    std::vector<Parameter> parameters;
    for_each_number(
        model,
        [&](const Uncertain& number, auto make_name) {
            parameters.push_back(base_parameter(make_name(), number));
        },
        [&](const Ambient& ambient) { parameters.push_back(ambient_parameter(ambient)); },
        [&](std::size_t effect, const EffectParameter& given) {
            const EffectForm& form = form_of(model.effects[effect]);
            const auto definition =
                std::ranges::find(form.parameters, given.name, &EffectParameterDefinition::name);
            parameters.push_back(effect_parameter(model, effect, *definition, given));
        });
    return parameters;
}

void set_parameter_values(Model& model, std::span<const double> values) {
    std::size_t next = 0;
    for_each_number(
        model, [&](Uncertain& number, auto) { number.value = values[next++]; },
        [&](Ambient& ambient) { ambient.value_C = values[next++]; },
        [&](std::size_t, EffectParameter& parameter) { parameter.value = values[next++]; });
}

double sigma_in_unit(bool logarithmic, double value, double coordinate_sigma) {
    return logarithmic ? value * relative_from_log(coordinate_sigma) : coordinate_sigma;
}

void set_parameter_sigmas(Model& model, std::span<const double> coordinate_sigmas) {
    constexpr double least = 1e-6;  // 0 would mean: known exactly
    std::size_t next = 0;
    const auto sigma = [&] { return std::max(coordinate_sigmas[next++], least); };
    for_each_number(
        model, [&](Uncertain& number, auto) { number.relative_sigma = relative_from_log(sigma()); },
        [&](Ambient& ambient) { ambient.sigma_C = sigma(); },
        [&](std::size_t effect, EffectParameter& parameter) {
            const EffectForm& form = form_of(model.effects[effect]);
            const auto definition =
                std::ranges::find(form.parameters, parameter.name, &EffectParameterDefinition::name);
            parameter.sigma = sigma_in_unit(definition->logarithmic, parameter.value, sigma());
        });
}

}  // namespace thermbal
