#include <memory>

#include "commands.hpp"
#include "simulate_command.hpp"

namespace thermbal {
namespace {

constexpr char group[] = "On a simulation model";

}  // namespace

void add_model_commands(CLI::App& app, int& status) {
    const auto simulate = std::make_shared<SimulateCommand>();
    CLI::App& simulate_command = *app.add_subcommand("simulate", "what a model's sensors would read");
    simulate_command.group(group);
    simulate_command.add_option("MODEL", simulate->model, "simulation model: TOML")->required();
    simulate_command.add_option(
        "--inputs", simulate->inputs,
        "recorded test: its columns drive the model, its first readings are where it starts");
    simulate_command
        .add_option("--duration-min", simulate->duration_min,
                    "until this time; without it, to the end of the inputs")
        ->check(CLI::Range(0.0, 1e6));
    simulate_command
        .add_option("--every-s", simulate->every_s, "between samples where the inputs hold no readings")
        ->capture_default_str()
        ->check(CLI::Range(0.01, 86400.0));
    simulate_command
        .add_option("--csv", simulate->csv, "where the simulated test goes; - is standard output")
        ->required();
    simulate_command.add_flag("--nodes", simulate->nodes, "the nodes' temperatures, too, as columns NODE_C");
    simulate_command.callback([&status, simulate] { status = run_simulate(*simulate); });
}

}  // namespace thermbal
