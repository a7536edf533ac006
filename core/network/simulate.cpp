#include "network/simulate.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "initial_state.hpp"
#include "integrator.hpp"
#include "placed_effect.hpp"

namespace thermbal {
namespace {

using Eigen::Index;

Result<void> check_times(const Inputs& inputs, std::span<const double> sample_times_s) {
    const auto increasing = [](std::span<const double> times) {
        return std::ranges::adjacent_find(times, [](double a, double b) { return !(a < b); }) == times.end();
    };
    if (!increasing(inputs.time_s))
        return fail(NextStep::refuse_input, "the times of the inputs do not increase");
    if (!increasing(sample_times_s)) return fail(NextStep::refuse_input, "the sample times do not increase");
    const double start_s = inputs.time_s.empty() ? 0.0 : inputs.time_s.front();
    if (!sample_times_s.empty() && !(sample_times_s.front() >= start_s)) {
        return fail(NextStep::refuse_input,
                    fmt::format("the first sample, at {} s, is before the inputs begin, at {} s",
                                sample_times_s.front(), start_s));
    }
    for (const Column& column : inputs.columns) {
        if (column.values.size() != inputs.time_s.size()) {
            return fail(NextStep::refuse_input,
                        fmt::format("column {} has {} rows, the times have {}", column.name,
                                    column.values.size(), inputs.time_s.size()));
        }
    }
    return {};
}

/// REQUIRES: validate(model).
Result<CompiledNetwork> compile(const Model& model, InputSchedule& schedule) {
    NetworkBuilder builder(model, schedule);
    for (const Effect& effect : model.effects) {
        const EffectDefinition& definition = *find_effect(effect.kind);
        const std::vector<double> values = effect_values(definition, effect);
        definition.attach(place(definition, effect, model, values), builder);
    }
    return std::move(builder).finish();
}

/// What a sensor reads more than its node's mean because of where it sits in the node.
double of_place(const Sensor& sensor, const CompiledSensor& compiled, double reading_C,
                const Eigen::VectorXd& initial_C) {
    if (compiled.node == ambient_index) return 0.0;
    return sensor.place_share * (reading_C - initial_C[static_cast<Index>(compiled.node)]);
}

double first_ambient(const CompiledNetwork& network, InputSchedule& schedule) {
    HeatFlow heat(network, schedule);
    heat.begin_step(schedule.start_s(), schedule.start_s());
    return heat.ambient_C(schedule.start_s());
}

}  // namespace

Result<Simulation> simulate(const Model& model, const Inputs& inputs, std::span<const double> sample_times_s,
                            const SimulationOptions& options) {
    if (auto valid = validate(model); !valid) return std::unexpected(valid.error());
    if (auto valid = check_times(inputs, sample_times_s); !valid) return std::unexpected(valid.error());
    InputSchedule schedule(inputs, sample_times_s);
    const auto network = compile(model, schedule);
    if (!network) return std::unexpected(network.error());
    const Eigen::VectorXd initial_C =
        initial_temperatures(*network, model, inputs, first_ambient(*network, schedule));

    Simulation simulation;
    const auto samples = static_cast<Index>(sample_times_s.size());
    simulation.node_names = network->node_names;
    simulation.node_C.resize(samples, initial_C.size());
    simulation.reading_C.resize(samples, static_cast<Index>(model.sensors.size()));
    simulation.ambient_C.resize(samples);
    SensorChain sensors(*network);
    Integrator integrator(*network, schedule, sensors, options);
    const auto record = [&](std::size_t sample, const Eigen::VectorXd& node_C, double ambient_C) {
        const auto row = static_cast<Index>(sample);
        simulation.node_C.row(row) = node_C;
        simulation.ambient_C[row] = ambient_C;
        for (std::size_t i = 0; i < model.sensors.size(); ++i) {
            const double reading_C = sensors.read(i, sample_times_s[sample], node_C, ambient_C);
            simulation.reading_C(row, static_cast<Index>(i)) =
                reading_C + of_place(model.sensors[i], network->sensors[i], reading_C, initial_C);
        }
    };
    if (auto done = integrator.run(initial_C, sample_times_s, record); !done)
        return std::unexpected(done.error());
    simulation.switchings = integrator.switchings();
    simulation.steps = integrator.steps();
    return simulation;
}

}  // namespace thermbal
