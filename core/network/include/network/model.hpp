#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

/// The node that always exists: the air around the machine. Its temperature is given, not computed.
inline constexpr std::string_view ambient_node = "ambient";

/// A positive number and how well it is known: the standard deviation over the value. 0: known exactly, never
/// fitted.
struct Uncertain {
    double value = 0.0;
    double relative_sigma = 0.0;
};

/// The temperature of the room: a column of the recording when `column` is not empty, else a constant.
struct Ambient {
    std::string column;
    double value_C = 20.0;
    double sigma_C = 0.0;  ///< how well the constant is known; 0: exactly
};

struct Node {
    std::string name;
    Uncertain heat_capacity_J_per_K;
};

/// Heat flows from the warmer to the cooler end: conductance * difference.
struct ThermalLink {
    std::string a;
    std::string b;
    Uncertain conductance_W_per_K;

    bool to_ambient() const { return a == ambient_node || b == ambient_node; }
    /// REQUIRES: to_ambient().
    const std::string& surface_node() const { return a == ambient_node ? b : a; }
};

/// Heat that enters a node. With a column: power_W * |column / reference| ^ exponent, else power_W all the
/// time.
struct Source {
    std::string name;  ///< how an effect refers to it; the node's name unless there are several on it
    std::string node;
    Uncertain power_W;
    std::string proportional_to;  ///< a column; empty: always on
    double reference = 1.0;
    Uncertain exponent{1.0, 0.0};
};

struct Sensor {
    std::string channel;
    std::string node;  ///< may be the ambient
    double noise_C = 0.05;
    /// Where it sits in its node: it rises by this share more than the node does.
    double place_share = 0.0;
};

struct EffectParameter {
    std::string name;  ///< with its unit, as the catalogue names it
    double value = 0.0;
    double sigma = 0.0;  ///< standard deviation of an earlier fit; 0: not stated, the catalogue's prior holds
};

/// What an effect was found on: for a person, never computed with.
struct EffectProvenance {
    std::string found_on;  ///< file or test
    double probability = 0.0;
    std::string note;
};

/// One effect of the catalogue, in place. `at` names the node, the source, the channel, the column, or the
/// surface node of a link to the ambient, as the form's site says (network/effect.hpp); empty where it acts
/// everywhere. Parameters that the form makes optional may be absent: they then stand at their neutral value.
struct Effect {
    std::string kind;
    std::string form;  ///< empty: the first form of the kind
    std::string at;
    std::vector<EffectParameter> parameters;
    EffectProvenance provenance;

    /// NaN when the parameter is absent.
    double parameter(std::string_view name) const;
    /// Adds it when it is absent.
    void set_parameter(std::string_view name, double value);
};

/// A lumped thermal network of a machine: what an engineer writes down, and what diagnose extends. Plain
/// data; names refer to names. Units are in the field names, temperatures in C.
struct Model {
    std::string name;
    Ambient ambient;
    double relative_sigma = 0.3;  ///< of every number that does not say itself
    std::vector<Node> nodes;
    std::vector<ThermalLink> links;
    std::vector<Source> sources;
    std::vector<Sensor> sensors;
    std::vector<Effect> effects;
};

/// Positions by name; empty when there is none.
std::optional<std::size_t> find_node(const Model& model, std::string_view name);
std::optional<std::size_t> find_source(const Model& model, std::string_view name);
std::optional<std::size_t> find_sensor(const Model& model, std::string_view channel);
/// The link between this node and the ambient.
std::optional<std::size_t> find_ambient_link(const Model& model, std::string_view surface_node);
/// The nodes that links reach from this one, the ambient excluded.
std::vector<std::string> neighbours(const Model& model, std::string_view node);

/// Where in a model a mistake is: table 3 of [[link]], key "between". A file's loader turns it into line and
/// column.
struct ModelPlace {
    enum class Table { model, node, link, source, sensor, effect };
    Table table = Table::model;
    std::size_t index = 0;
    std::string key;
};

struct ModelMistake {
    ModelPlace place;
    std::string text;  ///< what was found and what would be accepted
};

/// Every mistake of a model: names that are not there or not unique, values that are not positive or not
/// finite, nodes that no path connects to the ambient, effects that the catalogue does not have or that do
/// not fit their place.
std::vector<ModelMistake> check_model(const Model& model);

/// check_model as one error (refuse_input), one line a mistake.
Result<void> validate(const Model& model);

}  // namespace thermbal
