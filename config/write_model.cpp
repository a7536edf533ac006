#include <sstream>

#include <fmt/format.h>

#include "config/model_file.hpp"
#include "network/effect.hpp"
#include "toml_reader.hpp"

namespace thermbal {
namespace {

/// Reads back to the same double, and as TOML's float.
std::string number(double value) {
    std::string text = fmt::format("{}", value);
    if (text.find_first_of(".en") == std::string::npos) text += ".0";
    return text;
}

std::string uncertain(const Uncertain& given, double default_sigma) {
    if (given.relative_sigma == default_sigma) return number(given.value);
    return fmt::format("{{ value = {}, relative_sigma = {} }}", number(given.value),
                       number(given.relative_sigma));
}

std::string write_source(const Source& source, double sigma) {
    std::string text = "\n[[source]]\n";
    if (source.name != source.node) text += fmt::format("name = {}\n", toml_quoted(source.name));
    text +=
        fmt::format("node = {}\npower_W = {}\n", toml_quoted(source.node), uncertain(source.power_W, sigma));
    if (!source.proportional_to.empty()) {
        text += fmt::format("proportional_to = {}\nreference = {}\nexponent = {}\n",
                            toml_quoted(source.proportional_to), number(source.reference),
                            uncertain(source.exponent, 0.0));
    }
    return text;
}

std::string write_place(const EffectForm& form, const Effect& effect) {
    if (form.site == EffectSite::whole_model) return "";
    if (form.site == EffectSite::ambient_link)
        return fmt::format("link = [{}, \"ambient\"]\n", toml_quoted(effect.at));
    return fmt::format("{} = {}\n", site_key(form.site), toml_quoted(effect.at));
}

std::string write_parameter(const EffectParameter& parameter) {
    if (parameter.sigma <= 0.0) return fmt::format("{} = {}\n", parameter.name, number(parameter.value));
    return fmt::format("{} = {{ value = {}, sigma = {} }}\n", parameter.name, number(parameter.value),
                       number(parameter.sigma));
}

std::string write_effect(const Effect& effect) {
    const EffectDefinition& definition = *find_effect(effect.kind);
    const EffectForm& form = definition.form_of(effect);
    std::string text = fmt::format("\n# {}\n# {}\n[[effect]]\nkind = {}\n", definition.summary, form.equation,
                                   toml_quoted(effect.kind));
    if (!effect.form.empty()) text += fmt::format("form = {}\n", toml_quoted(effect.form));
    text += write_place(form, effect);
    for (const EffectParameter& parameter : effect.parameters) text += write_parameter(parameter);
    const EffectProvenance& provenance = effect.provenance;
    if (!provenance.found_on.empty())
        text += fmt::format("found_on = {}\n", toml_quoted(provenance.found_on));
    if (provenance.probability > 0.0)
        text += fmt::format("probability = {}\n", number(provenance.probability));
    if (!provenance.note.empty()) text += fmt::format("note = {}\n", toml_quoted(provenance.note));
    return text;
}

std::string as_comment(std::string_view comment) {
    std::string text;
    std::istringstream lines{std::string(comment)};
    for (std::string line; std::getline(lines, line);) text += line.empty() ? "#\n" : "# " + line + "\n";
    return text;
}

std::string write_model_table(const Model& model) {
    const Ambient& ambient = model.ambient;
    std::string text =
        fmt::format("[model]\nname = {}\nambient_C = {}\n", toml_quoted(model.name),
                    ambient.column.empty() ? number(ambient.value_C) : toml_quoted(ambient.column));
    if (ambient.sigma_C > 0.0) text += fmt::format("ambient_sigma_C = {}\n", number(ambient.sigma_C));
    return text + fmt::format("relative_sigma = {}\n", number(model.relative_sigma));
}

}  // namespace

std::string write_model(const Model& model, std::string_view comment) {
    std::string text = as_comment(comment) + write_model_table(model);
    const double sigma = model.relative_sigma;
    for (const Node& node : model.nodes) {
        text += fmt::format("\n[[node]]\nname = {}\nheat_capacity_J_per_K = {}\n", toml_quoted(node.name),
                            uncertain(node.heat_capacity_J_per_K, sigma));
    }
    for (const ThermalLink& link : model.links) {
        text += fmt::format("\n[[link]]\nbetween = [{}, {}]\nconductance_W_per_K = {}\n", toml_quoted(link.a),
                            toml_quoted(link.b), uncertain(link.conductance_W_per_K, sigma));
    }
    for (const Source& source : model.sources) text += write_source(source, sigma);
    for (const Sensor& sensor : model.sensors) {
        text += fmt::format("\n[[sensor]]\nchannel = {}\nnode = {}\nnoise_C = {}\n",
                            toml_quoted(sensor.channel), toml_quoted(sensor.node), number(sensor.noise_C));
        if (sensor.place_share != 0.0) text += fmt::format("place_share = {}\n", number(sensor.place_share));
    }
    for (const Effect& effect : model.effects) text += write_effect(effect);
    return text;
}

}  // namespace thermbal
