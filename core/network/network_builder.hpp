#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "even_table.hpp"
#include "input_schedule.hpp"
#include "network/model.hpp"

namespace thermbal {

/// What a term of the heat balance may look at. Something that switches at a moment asks `step_middle_s`: no
/// step crosses a break, so the middle is always on the right side. Something smooth asks `time_s`.
struct NetworkState {
    double time_s = 0.0;
    double step_middle_s = 0.0;
    const double* node_C = nullptr;
    double ambient_C = 0.0;
    const double* source_drive = nullptr;  ///< per source: |column / reference| ^ exponent, 0 while stopped
};

using StateFunction = std::function<double(const NetworkState&)>;

/// Whether a term is constant between breaks (it enters the exact exponentials) or has to be integrated.
enum class Variation { steps, smooth };

struct HeatTerm {
    std::size_t node;
    StateFunction power_W;
};
struct SourceFactor {
    std::size_t source;
    StateFunction factor;
};
/// Takes power_W from its node from the moment it is warmer than on_C until it is cooler than off_C.
struct Thermostat {
    std::size_t node;
    double power_W;
    double on_C;
    double off_C;
};
/// From from_s on the conductance from this node to the ambient is multiplied.
struct SurfaceChange {
    std::size_t node;
    double factor;
    double from_s;
};
struct ReadingTerm {
    std::size_t sensor;
    std::function<double(double time_s)> added_C;
};
/// From from_s on the sensor measures a share of the ambient, to which it goes over with a time constant;
/// zero: at once.
struct Detachment {
    std::size_t sensor;
    double ambient_share;
    double from_s;
    double time_constant_s = 0.0;
};

struct CompiledLink {
    std::size_t a;
    std::size_t b;
    double conductance_W_per_K;
};
struct CompiledSource {
    std::size_t node;
    double power_W;
    std::size_t column;  ///< of the schedule; no_column: always on
    double reference;
    double exponent;
};
struct CompiledSensor {
    std::size_t node;  ///< ambient_index: the air
    double time_constant_s = 0.0;
};

inline constexpr std::size_t ambient_index = std::numeric_limits<std::size_t>::max();
inline constexpr std::size_t no_column = std::numeric_limits<std::size_t>::max();

/// A model with names resolved, plus what its effects add. The model's own nodes come first, in its order.
struct CompiledNetwork {
    std::vector<std::string> node_names;
    std::vector<double> capacity_J_per_K;
    std::vector<CompiledLink> links;      ///< between nodes
    std::vector<double> surface_W_per_K;  ///< per node: conductance to the ambient, 0 without
    std::vector<CompiledSource> sources;
    std::vector<CompiledSensor> sensors;
    double ambient_C = 0.0;
    std::size_t ambient_column = no_column;
    std::size_t followed_column = no_column;  ///< the room is this column to followed_share
    double followed_share = 0.0;

    std::vector<SurfaceChange> surface_changes;
    std::vector<HeatTerm> heat_terms;
    std::vector<SourceFactor> source_factors;
    std::vector<Thermostat> thermostats;
    std::vector<StateFunction> ambient_shifts;       ///< of the time alone
    std::vector<EvenTable> surface_factors;          ///< of |node - ambient|
    std::vector<std::pair<double, double>> stops_s;  ///< sources are off from first to second
    std::vector<ReadingTerm> reading_terms;
    std::vector<Detachment> detachments;
    std::vector<double> breaks_s;  ///< moments at which something jumps or kinks
    bool smooth = false;           ///< some term is not constant between breaks
};

/// What an effect can do to a network. Indices are those of the model.
class NetworkBuilder {
  public:
    /// REQUIRES: validate(model). `schedule` outlives the builder.
    NetworkBuilder(const Model& model, InputSchedule& schedule);

    void add_heat(std::size_t node, StateFunction power_W, Variation variation);
    void multiply_source(std::size_t source, StateFunction factor);
    void add_thermostat(const Thermostat& thermostat) { network_.thermostats.push_back(thermostat); }
    /// The sources stand still in between; the breaks are added.
    void stop_sources(double from_s, double to_s);
    void add_node_behind(std::size_t node, double capacity_J_per_K, double conductance_W_per_K);
    void change_surface(const SurfaceChange& change);
    /// Of every surface: conductance times factor(|node - ambient|), which is smooth and even.
    void multiply_surfaces(std::function<double(double difference_C)> factor);
    void shift_ambient(StateFunction added_C, Variation variation);
    /// The room is what a column of the recording says, to this share, and the model's ambient for the rest.
    void follow_column(std::string_view column, double share);
    void add_break(double time_s) { network_.breaks_s.push_back(time_s); }

    void lag_sensor(std::size_t sensor, double time_constant_s);
    void add_to_reading(std::size_t sensor, std::function<double(double time_s)> added_C);
    void detach_sensor(const Detachment& detachment);

    std::size_t node_of_source(std::size_t source) const { return network_.sources[source].node; }
    /// Conductances of a node's links to other nodes, by node.
    std::vector<std::pair<std::size_t, double>> links_of(std::size_t node) const;
    /// When a node's thermostat was seen to switch, on first; empty: its temperature says.
    std::vector<double> seen_switchings_s(std::string_view node) const {
        return schedule_.seen_switchings_s(node);
    }
    double start_s() const { return schedule_.start_s(); }
    double end_s() const { return schedule_.end_s(); }

    /// The network with all effects, or the first thing that was missing.
    Result<CompiledNetwork> finish() &&;

  private:
    /// no_column, and `missing_` says so, when the inputs do not have it.
    std::size_t use_column(std::string_view name, std::string_view wanted_by);

    InputSchedule& schedule_;
    CompiledNetwork network_;
    std::string missing_;
};

}  // namespace thermbal
