#include <algorithm>
#include <array>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "config/model_file.hpp"
#include "network/effect.hpp"
#include "toml_reader.hpp"

namespace thermbal {
namespace {

constexpr Range positive{1e-9, 1e12};
constexpr Range temperature_C{-100.0, 1000.0};
constexpr Range relative{0.0, 10.0};

class ModelLoader {
  public:
    /// `columns`: of the test that the model is for; null: of any.
    ModelLoader(const toml::table& root, Complaints& complaints, const TestColumns* columns)
        : root_(root), complaints_(complaints), columns_(columns) {}

    Model load() {
        TableReader reader(root_, "", complaints_);
        reader.require("model", "a [model] table");
        if (const toml::table* table = reader.table("model")) read_model_table(*table);
        reader.require("node", "one [[node]] a mass");
        each(reader, "node", ModelPlace::Table::node, &ModelLoader::read_node);
        each(reader, "link", ModelPlace::Table::link, &ModelLoader::read_link);
        each(reader, "source", ModelPlace::Table::source, &ModelLoader::read_source);
        each(reader, "sensor", ModelPlace::Table::sensor, &ModelLoader::read_sensor);
        each(reader, "effect", ModelPlace::Table::effect, &ModelLoader::read_effect);
        reader.finish();
        // What the rest would say about a number that was refused would be about its default.
        if (complaints_.empty()) complain_about_the_whole();
        if (complaints_.empty() && columns_ != nullptr) complain_about_columns();
        return std::move(model_);
    }

  private:
    using Tables = std::vector<const toml::table*>;

    void each(TableReader& reader, std::string_view key, ModelPlace::Table kind,
              void (ModelLoader::*read)(TableReader&, const toml::table&)) {
        for (const toml::table* table : reader.tables(key)) {
            TableReader one(*table, std::string(key), complaints_);
            (this->*read)(one, *table);
            one.finish();
            tables_of(kind).push_back(table);
        }
    }

    Tables& tables_of(ModelPlace::Table kind) { return tables_[static_cast<std::size_t>(kind)]; }

    void read_model_table(const toml::table& table) {
        TableReader reader(table, "model", complaints_);
        set(model_.name, reader.text("name"));
        reader.require("ambient_C", "a temperature, or the name of a column");
        if (table["ambient_C"].is_string())
            set(model_.ambient.column, reader.text("ambient_C"));
        else
            set(model_.ambient.value_C, reader.number("ambient_C", temperature_C));
        set(model_.ambient.sigma_C, reader.number("ambient_sigma_C", {0.0, 100.0}));
        set(model_.relative_sigma, reader.number("relative_sigma", relative));
        reader.finish();
        tables_of(ModelPlace::Table::model).push_back(&table);
    }

    /// A number, or { value, relative_sigma }.
    Uncertain uncertain(TableReader& reader, const toml::table& table, std::string_view key,
                        double default_sigma) {
        reader.require(key, "a number, or { value = ..., relative_sigma = ... }");
        Uncertain number{1.0, default_sigma};
        if (!table[key].is_table()) {
            set(number.value, reader.number(key, positive));
            return number;
        }
        TableReader parts(*reader.table(key), fmt::format("{}", key), complaints_);
        parts.require("value", "a positive number");
        set(number.value, parts.number("value", positive));
        set(number.relative_sigma, parts.number("relative_sigma", relative));
        parts.finish();
        return number;
    }

    std::string required_text(TableReader& reader, std::string_view key, std::string_view accepted) {
        reader.require(key, accepted);
        return reader.text(key).value_or("");
    }

    void read_node(TableReader& reader, const toml::table& table) {
        Node node;
        node.name = required_text(reader, "name", "a name");
        node.heat_capacity_J_per_K = uncertain(reader, table, "heat_capacity_J_per_K", model_.relative_sigma);
        model_.nodes.push_back(std::move(node));
    }

    void read_link(TableReader& reader, const toml::table& table) {
        ThermalLink link;
        reader.require("between", "[\"node\", \"node\"]; \"ambient\" is a node, too");
        if (const auto ends = reader.texts("between")) {
            if (ends->size() == 2)
                std::tie(link.a, link.b) = std::pair((*ends)[0], (*ends)[1]);
            else
                reader.complain("between", fmt::format("found {} names; accepted: two", ends->size()));
        }
        link.conductance_W_per_K = uncertain(reader, table, "conductance_W_per_K", model_.relative_sigma);
        model_.links.push_back(std::move(link));
    }

    /// Unless it has one of its own, a source is called as its node; the second there "node 2".
    std::string source_name(const std::string& node) const {
        const auto same = std::ranges::count(model_.sources, node, &Source::node);
        return same == 0 ? node : fmt::format("{} {}", node, same + 1);
    }

    void read_source(TableReader& reader, const toml::table& table) {
        Source source;
        source.node = required_text(reader, "node", "the name of a [[node]]");
        source.name = reader.text("name").value_or(source_name(source.node));
        source.power_W = uncertain(reader, table, "power_W", model_.relative_sigma);
        set(source.proportional_to, reader.text("proportional_to"));
        if (!source.proportional_to.empty()) {
            reader.require("reference", "the column's value at which power_W holds");
        }
        set(source.reference, reader.number("reference", any_number));
        // Exactly known unless it says itself: one speed says nothing about it.
        if (reader.has("exponent")) source.exponent = exponent(reader, table);
        model_.sources.push_back(std::move(source));
    }

    Uncertain exponent(TableReader& reader, const toml::table& table) {
        if (table["exponent"].is_table()) return uncertain(reader, table, "exponent", 0.0);
        return {reader.number("exponent", {0.0, 10.0}).value_or(1.0), 0.0};
    }

    void read_sensor(TableReader& reader, const toml::table&) {
        Sensor sensor;
        sensor.channel = required_text(reader, "channel", "T1, T2, ...");
        sensor.node = required_text(reader, "node", "the name of a [[node]], or \"ambient\"");
        set(sensor.noise_C, reader.number("noise_C", {1e-6, 100.0}));
        set(sensor.place_share, reader.number("place_share", any_number));
        model_.sensors.push_back(std::move(sensor));
    }

    void read_effect(TableReader& reader, const toml::table& table) {
        Effect effect;
        effect.kind = required_text(reader, "kind", "an effect of the catalogue");
        set(effect.form, reader.text("form"));
        set(effect.provenance.found_on, reader.text("found_on"));
        set(effect.provenance.probability, reader.number("probability", {0.0, 1.0}));
        set(effect.provenance.note, reader.text("note"));
        const EffectDefinition* definition = find_effect(effect.kind);
        const EffectForm* form = definition == nullptr ? nullptr : definition->form(effect.form);
        if (form == nullptr) {
            // check_model says which kinds and forms there are; its keys cannot be judged.
            for (const auto& [key, value] : table) reader.leave(key.str());
        } else {
            read_place(reader, table, site_key(form->site), effect);
            for (const auto& parameter : form->parameters)
                read_parameter(reader, table, parameter.name, effect);
        }
        model_.effects.push_back(std::move(effect));
    }

    /// link = ["sleeve", "ambient"], or the surface's node alone, as everywhere else.
    void read_place(TableReader& reader, const toml::table& table, std::string_view key, Effect& effect) {
        if (key.empty()) return;
        reader.require(key, fmt::format("the name of a {}", key));
        if (key != "link" || table[key].is_string()) {
            set(effect.at, reader.text(key));
        } else if (const auto ends = reader.texts(key)) {
            const bool fits = ends->size() == 2 && std::ranges::count(*ends, std::string(ambient_node)) == 1;
            if (fits)
                effect.at = (*ends)[0] == ambient_node ? (*ends)[1] : (*ends)[0];
            else
                reader.complain(key, "accepted: [\"node\", \"ambient\"]");
        }
    }

    void read_parameter(TableReader& reader, const toml::table& table, const std::string& name,
                        Effect& effect) {
        if (!reader.has(name)) return;
        EffectParameter parameter{name, 0.0, 0.0};
        if (table[name].is_table()) {
            TableReader parts(*reader.table(name), name, complaints_);
            parts.require("value", "a number");
            set(parameter.value, parts.number("value", any_number));
            set(parameter.sigma, parts.number("sigma", {0.0, 1e12}));
            parts.finish();
        } else {
            set(parameter.value, reader.number(name, any_number));
        }
        effect.parameters.push_back(std::move(parameter));
    }

    void complain_about_the_whole() {
        static constexpr std::array<std::string_view, 6> names = {"model",  "node",   "link",
                                                                  "source", "sensor", "effect"};
        for (const ModelMistake& mistake : check_model(model_)) {
            const Tables& tables = tables_of(mistake.place.table);
            const toml::table& table =
                mistake.place.index < tables.size() ? *tables[mistake.place.index] : root_;
            const toml::node* key = table.get(mistake.place.key);
            const std::string_view name = names[static_cast<std::size_t>(mistake.place.table)];
            complaints_.add(
                key == nullptr ? table.source() : key->source(),
                mistake.place.key.empty() ? std::string(name) : fmt::format("{}.{}", name, mistake.place.key),
                mistake.text);
        }
    }

    const toml::node& place(ModelPlace::Table kind, std::size_t index, std::string_view key) {
        const toml::table& table = *tables_of(kind)[index];
        const toml::node* node = table.get(key);
        return node == nullptr ? table : *node;
    }

    void complain_about_columns() {
        const auto known = [&](const std::string& name) {
            return name.empty() || columns_->channels.contains(name) || columns_->inputs.contains(name);
        };
        if (!known(model_.ambient.column)) {
            complaints_.add(
                place(ModelPlace::Table::model, 0, "ambient_C").source(), "model.ambient_C",
                fmt::format("found \"{}\"; the test has no such channel; accepted: a number or {}",
                            model_.ambient.column, fmt::join(columns_->channels, ", ")));
        }
        for (std::size_t i = 0; i < model_.sources.size(); ++i) {
            const std::string& column = model_.sources[i].proportional_to;
            if (known(column)) continue;
            complaints_.add(
                place(ModelPlace::Table::source, i, "proportional_to").source(), "source.proportional_to",
                fmt::format("found \"{0}\"; the test has no such input; say what it is: start --input "
                            "{0}=VALUE, or inputs = {{ {0} = VALUE }} in [test]",
                            column));
        }
        const bool measured = std::ranges::any_of(model_.sensors, [&](const Sensor& sensor) {
            return columns_->channels.contains(sensor.channel);
        });
        if (measured) return;
        complaints_.add(root_.source(), "sensor.channel",
                        fmt::format("no [[sensor]] is a channel of the test; its channels are {}",
                                    fmt::join(columns_->channels, ", ")));
    }

    const toml::table& root_;
    Complaints& complaints_;
    const TestColumns* columns_;
    Model model_;
    std::array<Tables, 6> tables_;
};

Result<Model> loaded(std::string_view toml, std::string_view file_name, const TestColumns* columns) {
    Complaints complaints(file_name);
    const auto root = parse_toml(toml, complaints);
    if (!root) return std::unexpected(complaints.error());
    Model model = ModelLoader(*root, complaints, columns).load();
    if (!complaints.empty()) return std::unexpected(complaints.error());
    return model;
}

}  // namespace

Result<Model> load_model(std::string_view toml, std::string_view file_name) {
    return loaded(toml, file_name, nullptr);
}

Result<Model> load_model(std::string_view toml, std::string_view file_name, const TestColumns& columns) {
    return loaded(toml, file_name, &columns);
}

}  // namespace thermbal
