#include "simulate_command.hpp"

#include <utility>

#include <fmt/format.h>

#include "files.hpp"
#include "model_input.hpp"
#include "network/simulate.hpp"
#include "output.hpp"

namespace thermbal {
namespace {

/// The scans of a recorded test up to the end; behind the last one, and where the inputs hold no readings,
/// every `every_s`.
Result<std::vector<double>> sample_times(const SimulateCommand& command, const RecordedTest& recorded) {
    if (!command.duration_min && recorded.time_s.empty()) {
        return fail(NextStep::refuse_input,
                    "simulate: how long is not said; give --duration-min M, --inputs FILE.csv, or both");
    }
    const double begin_s = recorded.time_s.empty() ? 0.0 : recorded.time_s.front();
    const double end_s = command.duration_min ? *command.duration_min * 60.0 : recorded.time_s.back();
    if (end_s < begin_s) {
        return fail(NextStep::refuse_input,
                    fmt::format("{}: begins at {} s; --duration-min {} ends before that", command.inputs,
                                begin_s, *command.duration_min));
    }
    constexpr double most_samples = 1e7;
    if ((end_s - begin_s) / command.every_s > most_samples) {
        return fail(NextStep::refuse_input,
                    "simulate: more than ten million samples; give a longer --every-s");
    }
    std::vector<double> times = {begin_s};
    if (!recorded.channels.empty()) {
        times = recorded.time_s;
        std::erase_if(times, [end_s](double row_s) { return row_s > end_s; });
    }
    const double last_s = times.back();
    for (double k = 1.0; last_s + k * command.every_s <= end_s; k += 1.0)
        times.push_back(last_s + k * command.every_s);
    return times;
}

/// A column of the inputs at other times: held from the row before.
std::vector<double> held(const std::vector<double>& time_s, const std::vector<double>& values,
                         const std::vector<double>& at_s) {
    std::vector<double> result;
    result.reserve(at_s.size());
    std::size_t row = 0;
    for (const double wanted_s : at_s) {
        while (row + 1 < time_s.size() && time_s[row + 1] <= wanted_s) ++row;
        result.push_back(values[row]);
    }
    return result;
}

std::vector<double> column_of(const Eigen::MatrixXd& matrix, std::size_t column) {
    const auto values = matrix.col(static_cast<Eigen::Index>(column));
    return {values.begin(), values.end()};
}

RecordedTest as_recorded_test(const SimulateCommand& command, const Model& model,
                              const Simulation& simulation, const RecordedTest& inputs,
                              std::vector<double> times) {
    RecordedTest test;
    for (std::size_t i = 0; i < model.sensors.size(); ++i) {
        test.channels.push_back({model.sensors[i].channel, column_of(simulation.reading_C, i)});
    }
    for (const Column& input : inputs.inputs) {
        test.inputs.push_back({input.name, held(inputs.time_s, input.values, times)});
    }
    for (std::size_t i = 0; command.nodes && i < simulation.node_names.size(); ++i) {
        test.inputs.push_back({simulation.node_names[i] + "_C", column_of(simulation.node_C, i)});
    }
    test.time_s = std::move(times);
    return test;
}

Result<RecordedTest> simulated(const SimulateCommand& command) {
    const auto model = read_model(command.model);
    if (!model) return std::unexpected(model.error());
    RecordedTest recorded;
    if (!command.inputs.empty()) {
        auto read = read_recorded_test(command.inputs);
        if (!read) return std::unexpected(read.error());
        recorded = std::move(*read);
    }
    const Inputs inputs = inputs_of(recorded);
    auto times = sample_times(command, recorded);
    if (!times) return std::unexpected(times.error());
    const auto simulation = simulate(*model, inputs, *times);
    if (!simulation) {
        const std::string driven_by =
            command.inputs.empty() ? " (no --inputs given)" : " (" + command.inputs + ")";
        return fail(simulation.error().next,
                    fmt::format("{}: {}{}", command.model, simulation.error().message, driven_by));
    }
    return as_recorded_test(command, *model, *simulation, recorded, std::move(*times));
}

}  // namespace

int run_simulate(const SimulateCommand& command) {
    const auto test = simulated(command);
    if (!test) return report_error(test.error());
    const auto written = write_file(command.csv, format_recorded_test(*test));
    return written ? 0 : report_error(written.error());
}

}  // namespace thermbal
