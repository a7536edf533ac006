#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "network/model.hpp"

namespace thermbal {

class NetworkBuilder;

/// Where an effect acts, and so what Effect::at names.
enum class EffectSite {
    whole_model,   ///< every surface or every source: nothing to name
    node,          ///< a node
    source,        ///< a source
    ambient_link,  ///< the link to the ambient of the node that is named
    channel,       ///< a sensor
    column,        ///< a column of the recording
};

/// The key of an [[effect]] table that names the place: "node", "source", "link", "channel", "column"; empty
/// for whole_model.
std::string_view site_key(EffectSite site);

/// What a parameter's prior is a multiple of, so that one catalogue serves a machine of tons and a board of
/// grams.
enum class PriorUnit {
    absolute,           ///< the parameter's own unit
    mean_source_power,  ///< W: mean power of the model's sources
    mean_conductance,   ///< W/K: geometric mean of the model's conductances
    mean_capacity,      ///< J/K: geometric mean of the model's heat capacities
};

/// One parameter of an effect. Logarithmic: positive, fitted and with its prior on ln(value), prior_sigma is
/// then the standard deviation of the logarithm; else prior_sigma is in the parameter's unit. An infinite
/// prior_sigma is a flat prior between the bounds.
struct EffectParameterDefinition {
    std::string name;  ///< with unit: "power_W"
    double lower = 0.0;
    double upper = std::numeric_limits<double>::infinity();
    double prior_centre = 1.0;
    double prior_sigma = 1.0;
    bool logarithmic = false;
    PriorUnit prior_unit =
        PriorUnit::absolute;  ///< lower, upper, prior_centre (and linear sigma) are multiples of it
    std::optional<double> when_absent =
        std::nullopt;      ///< may be left out: its value then, and it is not fitted
    bool is_time = false;  ///< a moment of the run: an onset, a switching
    /// What a model file may say at all; the bounds above are a fit's.
    double least_accepted = -std::numeric_limits<double>::infinity();
    double most_accepted = std::numeric_limits<double>::infinity();
};

/// One way to write an effect down; most kinds have one. The first is the default.
struct EffectForm {
    std::string name;
    EffectSite site = EffectSite::node;
    std::string equation;
    std::vector<EffectParameterDefinition> parameters;  ///< the first is the one that sizes the effect
    /// When it acts follows from the temperatures: it is no multiple of one shape, and it jumps.
    bool steers_itself = false;
    /// The first form with further parameters: what describes best in that one describes nearly best in this.
    bool refines_first = false;
};

/// An effect with everything resolved: what its physics works on. values[i] belongs to parameters[i] of the
/// form.
struct PlacedEffect {
    std::size_t form = 0;
    std::size_t at = 0;  ///< index of the node, source, sensor or (ambient_link) surface node; column: unused
    std::string_view at_name;
    std::span<const double> values;
};

/// One entry of the catalogue: physics, parameters with units, bounds and priors, and what a person has to
/// know.
struct EffectDefinition {
    std::string kind;
    std::string summary;  ///< what was missing, in plain words
    std::string where;    ///< where it can act, in plain words
    std::vector<EffectForm> forms;
    std::string source;                    ///< of the equation and of the usual values
    std::vector<std::string> look_alikes;  ///< kinds that a single warm-up can hardly tell from it
    std::string told_apart_by;             ///< what data would
    /// Puts the physics into a network under construction (core/network/network_builder.hpp).
    void (*attach)(const PlacedEffect& effect, NetworkBuilder& network) = nullptr;

    const EffectForm* form(std::string_view name) const;    ///< empty name: the first; null when unknown
    const EffectForm& form_of(const Effect& effect) const;  ///< REQUIRES: effect's form is known
};

/// The catalogue, in the order of its list.
const std::vector<EffectDefinition>& effect_catalogue();

/// Null when the kind is unknown.
const EffectDefinition* find_effect(std::string_view kind);

/// REQUIRES: the effect's kind and form are known.
const EffectForm& form_of(const Effect& effect);
/// When an effect sets in; none where it always acts. REQUIRES: as form_of.
std::optional<double> onset_of(const Effect& effect);

/// The node where an effect at this place shows: a channel's is the one that its sensor sits on; empty where
/// it acts everywhere. REQUIRES: the place is one of the model.
std::string node_of_place(EffectSite site, std::string_view at, const Model& model);

/// A parameter's bounds and prior in its own unit, for one model.
struct ResolvedPrior {
    double lower;
    double upper;
    double centre;
    double sigma;  ///< of the logarithm when logarithmic; infinite: flat
    bool logarithmic;
};
ResolvedPrior resolve_prior(const EffectParameterDefinition& parameter, const Model& model);

/// An effect at a place with every required parameter at its prior's centre: where a fit may begin.
Effect make_effect(const EffectDefinition& definition, const EffectForm& form, std::string_view at,
                   const Model& model);

/// The places of a model at which this form can act: names for Effect::at; one empty name for whole_model;
/// none for column, whose places the recording knows.
std::vector<std::string> possible_places(const EffectForm& form, const Model& model);

}  // namespace thermbal
