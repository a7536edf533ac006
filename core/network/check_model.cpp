#include <algorithm>
#include <cmath>
#include <functional>
#include <ranges>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "network/effect.hpp"
#include "network/model.hpp"

namespace thermbal {
namespace {

using Table = ModelPlace::Table;

constexpr double most_place_share = 0.5;

class Checker {
  public:
    explicit Checker(const Model& model) : model_(model) {}

    std::vector<ModelMistake> check() {
        check_model_table();
        for (std::size_t i = 0; i < model_.nodes.size(); ++i) check_node(i);
        for (std::size_t i = 0; i < model_.links.size(); ++i) check_link(i);
        if (mistakes_.empty()) check_connected();
        for (std::size_t i = 0; i < model_.sources.size(); ++i) check_source(i);
        for (std::size_t i = 0; i < model_.sensors.size(); ++i) check_sensor(i);
        // An effect is judged against the places of a network that is sound.
        const std::size_t effects = mistakes_.empty() ? model_.effects.size() : 0;
        for (std::size_t i = 0; i < effects; ++i) check_effect(i);
        return std::move(mistakes_);
    }

  private:
    void complain(Table table, std::size_t index, std::string_view key, std::string text) {
        mistakes_.push_back({{table, index, std::string(key)}, std::move(text)});
    }

    void check_positive(Table table, std::size_t index, std::string_view key, const Uncertain& number) {
        if (!(number.value > 0.0) || !std::isfinite(number.value)) {
            complain(table, index, key, fmt::format("found {}; accepted: a positive number", number.value));
        }
        check_sigma(table, index, key, number.relative_sigma);
    }

    void check_sigma(Table table, std::size_t index, std::string_view key, double sigma) {
        if (!(sigma >= 0.0) || sigma > 10.0) {
            complain(table, index, key,
                     fmt::format("its relative_sigma is {}; accepted: 0 (exact) to 10", sigma));
        }
    }

    std::string node_names() const {
        return fmt::format("\"{}\"", fmt::join(model_.nodes | std::views::transform(&Node::name), "\", \""));
    }

    bool check_node_name(Table table, std::size_t index, std::string_view key, const std::string& name,
                         bool ambient_too) {
        if (find_node(model_, name) || (ambient_too && name == ambient_node)) return true;
        complain(table, index, key,
                 fmt::format("no node is called \"{}\"; accepted: {}{}", name, node_names(),
                             ambient_too ? ", \"ambient\"" : ""));
        return false;
    }

    void check_model_table() {
        if (!std::isfinite(model_.ambient.value_C)) complain(Table::model, 0, "ambient_C", "is not a number");
        if (!(model_.ambient.sigma_C >= 0.0) || std::isinf(model_.ambient.sigma_C)) {
            complain(Table::model, 0, "ambient_sigma_C", "accepted: 0 (exact) or more");
        }
        if (model_.nodes.empty()) complain(Table::model, 0, "", "has no [[node]]; accepted: one or more");
    }

    void check_node(std::size_t i) {
        const Node& node = model_.nodes[i];
        if (node.name.empty()) complain(Table::node, i, "name", "is empty; accepted: a name");
        if (node.name == ambient_node) {
            complain(Table::node, i, "name", "\"ambient\" exists without a [[node]]; accepted: another name");
        }
        if (find_node(model_, node.name) != i) {
            complain(Table::node, i, "name",
                     fmt::format("\"{}\" is there already; names are unique", node.name));
        }
        check_positive(Table::node, i, "heat_capacity_J_per_K", node.heat_capacity_J_per_K);
    }

    void check_link(std::size_t i) {
        const ThermalLink& link = model_.links[i];
        check_node_name(Table::link, i, "between", link.a, true);
        check_node_name(Table::link, i, "between", link.b, true);
        if (link.a == link.b) {
            complain(Table::link, i, "between", fmt::format("\"{}\" twice; accepted: two nodes", link.a));
        }
        const auto same = [&](const ThermalLink& other) {
            return (other.a == link.a && other.b == link.b) || (other.a == link.b && other.b == link.a);
        };
        if (std::find_if(model_.links.begin(), model_.links.begin() + static_cast<std::ptrdiff_t>(i), same) !=
            model_.links.begin() + static_cast<std::ptrdiff_t>(i)) {
            complain(Table::link, i, "between",
                     fmt::format("\"{}\" and \"{}\" are linked already; accepted: one link, with the sum",
                                 link.a, link.b));
        }
        check_positive(Table::link, i, "conductance_W_per_K", link.conductance_W_per_K);
    }

    /// Heat must be able to leave every node.
    void check_connected() {
        std::set<std::string, std::less<>> reached = {std::string(ambient_node)};
        for (std::size_t before = 0; before != reached.size();) {
            before = reached.size();
            for (const ThermalLink& link : model_.links) {
                if (reached.contains(link.a)) reached.insert(link.b);
                if (reached.contains(link.b)) reached.insert(link.a);
            }
        }
        for (std::size_t i = 0; i < model_.nodes.size(); ++i) {
            if (reached.contains(model_.nodes[i].name)) continue;
            complain(
                Table::node, i, "name",
                fmt::format("no path of links leads from \"{}\" to the ambient; its heat could not leave",
                            model_.nodes[i].name));
        }
    }

    void check_source(std::size_t i) {
        const Source& source = model_.sources[i];
        check_node_name(Table::source, i, "node", source.node, false);
        if (source.name.empty()) complain(Table::source, i, "name", "is empty; accepted: a name");
        if (find_source(model_, source.name) != i) {
            complain(Table::source, i, "name",
                     fmt::format("\"{}\" is there already; accepted: another name", source.name));
        }
        check_positive(Table::source, i, "power_W", source.power_W);
        if (!std::isfinite(source.reference) || source.reference == 0.0) {
            complain(Table::source, i, "reference", "accepted: a number other than 0");
        }
        if (!std::isfinite(source.exponent.value) || source.exponent.value < 0.0) {
            complain(Table::source, i, "exponent", "accepted: 0 or more");
        }
        check_sigma(Table::source, i, "exponent", source.exponent.relative_sigma);
    }

    void check_sensor(std::size_t i) {
        const Sensor& sensor = model_.sensors[i];
        if (sensor.channel.empty()) complain(Table::sensor, i, "channel", "is empty; accepted: T1, T2, ...");
        if (find_sensor(model_, sensor.channel) != i) {
            complain(Table::sensor, i, "channel", fmt::format("\"{}\" is on a node already", sensor.channel));
        }
        check_node_name(Table::sensor, i, "node", sensor.node, true);
        if (!(sensor.noise_C > 0.0) || !std::isfinite(sensor.noise_C)) {
            complain(Table::sensor, i, "noise_C",
                     fmt::format("found {}; accepted: a positive number", sensor.noise_C));
        }
        if (!(std::abs(sensor.place_share) <= most_place_share)) {
            complain(Table::sensor, i, "place_share",
                     fmt::format("found {}; accepted: {} to {}", sensor.place_share, -most_place_share,
                                 most_place_share));
        }
    }

    void check_effect(std::size_t i) {
        const Effect& effect = model_.effects[i];
        const EffectDefinition* definition = find_effect(effect.kind);
        if (definition == nullptr) {
            const auto kinds = effect_catalogue() | std::views::transform(&EffectDefinition::kind);
            return complain(Table::effect, i, "kind",
                            fmt::format("found \"{}\"; accepted: {}", effect.kind, fmt::join(kinds, ", ")));
        }
        const EffectForm* form = definition->form(effect.form);
        if (form == nullptr) {
            const auto forms = definition->forms | std::views::transform(&EffectForm::name);
            return complain(Table::effect, i, "form",
                            fmt::format("found \"{}\"; accepted: {}", effect.form, fmt::join(forms, ", ")));
        }
        check_place(i, *form);
        check_effect_parameters(i, *form);
    }

    void check_place(std::size_t i, const EffectForm& form) {
        const std::string& at = model_.effects[i].at;
        const std::string_view key = site_key(form.site);
        if (form.site == EffectSite::whole_model) return;
        if (form.site == EffectSite::column) {
            if (at.empty())
                complain(Table::effect, i, key, "is missing; accepted: a column of the recording");
            return;
        }
        const std::vector<std::string> places = possible_places(form, model_);
        if (std::ranges::find(places, at) != places.end()) return;
        if (form.site == EffectSite::channel && find_sensor(model_, at)) return;
        complain(Table::effect, i, key,
                 fmt::format("found \"{}\"; accepted: \"{}\"", at, fmt::join(places, "\", \"")));
    }

    void check_effect_parameters(std::size_t i, const EffectForm& form) {
        const Effect& effect = model_.effects[i];
        for (const EffectParameterDefinition& parameter : form.parameters) {
            const double value = effect.parameter(parameter.name);
            if (std::isnan(value)) {
                if (!parameter.when_absent) {
                    complain(Table::effect, i, parameter.name,
                             fmt::format("is missing; accepted: a number, in {}", form.equation));
                }
            } else if (!std::isfinite(value) || (parameter.logarithmic && value <= 0.0)) {
                complain(Table::effect, i, parameter.name,
                         fmt::format("found {}; accepted: a {}number", value,
                                     parameter.logarithmic ? "positive " : ""));
            } else if (value < parameter.least_accepted || value > parameter.most_accepted) {
                complain(Table::effect, i, parameter.name,
                         fmt::format("found {}; accepted: {}{}", value, parameter.least_accepted,
                                     std::isfinite(parameter.most_accepted)
                                         ? fmt::format(" to {}", parameter.most_accepted)
                                         : " or more"));
            }
        }
        for (const EffectParameter& given : effect.parameters) {
            if (std::ranges::find(form.parameters, given.name, &EffectParameterDefinition::name) ==
                form.parameters.end()) {
                complain(Table::effect, i, given.name,
                         fmt::format("is not a parameter of {}, form {}", effect.kind, form.name));
            }
        }
    }

    const Model& model_;
    std::vector<ModelMistake> mistakes_;
};

std::string_view table_name(Table table) {
    switch (table) {
        case Table::node:
            return "node";
        case Table::link:
            return "link";
        case Table::source:
            return "source";
        case Table::sensor:
            return "sensor";
        case Table::effect:
            return "effect";
        case Table::model:
            break;
    }
    return "model";
}

}  // namespace

std::vector<ModelMistake> check_model(const Model& model) {
    return Checker(model).check();
}

Result<void> validate(const Model& model) {
    const std::vector<ModelMistake> mistakes = check_model(model);
    if (mistakes.empty()) return {};
    std::string message;
    for (const ModelMistake& mistake : mistakes) {
        message += message.empty() ? "" : "\n";
        message += fmt::format("{} {}: {}: {}", table_name(mistake.place.table), mistake.place.index + 1,
                               mistake.place.key, mistake.text);
    }
    return fail(NextStep::refuse_input, std::move(message));
}

}  // namespace thermbal
