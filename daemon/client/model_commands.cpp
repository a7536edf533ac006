#include <memory>

#include "calibrate_command.hpp"
#include "commands.hpp"
#include "diagnose_command.hpp"
#include "manual/flags.hpp"
#include "simulate_command.hpp"

namespace thermbal {
namespace {

constexpr char group[] = "On a simulation model";

void add_simulate(CLI::App& app, int& status) {
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
        ->check(number_in(0.0, 1e6));
    simulate_command
        .add_option("--every-s", simulate->every_s, "between samples where the inputs hold no readings")
        ->capture_default_str()
        ->check(number_in(0.01, 86400.0));
    simulate_command
        .add_option("--csv", simulate->csv, "where the simulated test goes; - is standard output")
        ->required();
    simulate_command.add_flag("--nodes", simulate->nodes, "the nodes' temperatures, too, as columns NODE_C");
    simulate_command.callback([&status, simulate] { status = run_simulate(*simulate); });
}

void add_calibrate(CLI::App& app, int& status) {
    const auto calibrate = std::make_shared<CalibrateCommand>();
    CLI::App& calibrate_command = *app.add_subcommand(
        "calibrate", "fit a model's numbers to a recorded test, and say how well each is known");
    calibrate_command.group(group);
    calibrate_command.add_option("FILE", calibrate->file, "recorded test: CSV")->required();
    calibrate_command.add_option("--model", calibrate->model, "simulation model: TOML")->required();
    calibrate_command.add_option("--write-model", calibrate->write_model,
                                 "where the fitted model goes, with what is known now as its relative_sigma");
    calibrate_command.add_flag("--json", calibrate->json, "one JSON document on standard output");
    calibrate_command.callback([&status, calibrate] { status = run_calibrate(*calibrate); });
}

void add_diagnose(CLI::App& app, int& status) {
    const auto diagnose = std::make_shared<DiagnoseCommand>();
    CLI::App& diagnose_command = *app.add_subcommand(
        "diagnose", "where a model and a recorded test disagree, and what effect the model lacks");
    diagnose_command.group(group);
    auto* const file = diagnose_command.add_option("FILE", diagnose->file, "recorded test: CSV");
    auto* const test =
        diagnose_command
            .add_option("--test", diagnose->test, "instead: id of a stored test (see thermbalctl tests)")
            ->check(CLI::PositiveNumber)
            ->excludes(file);
    auto* const model = diagnose_command.add_option(
        "--model", diagnose->model,
        "simulation model: TOML; of a stored test without it the one that it was compared with");
    add_database_flags(diagnose_command, diagnose->database);
    diagnose_command.add_option("--holdout", diagnose->holdouts,
                                "another run of the machine, never fitted; may be given several times");
    diagnose_command.add_option("--write-model", diagnose->write_model,
                                "where the model with the effects found goes");
    diagnose_command.add_option("--report", diagnose->report, "where an HTML report goes");
    diagnose_command.add_option("--threads", diagnose->threads, "compute threads")
        ->capture_default_str()
        ->check(CLI::Range(1, 256));
    diagnose_command.add_flag("--json", diagnose->json, "one JSON document on standard output");
    diagnose_command.callback([&status, diagnose, file, test, model] {
        if (file->empty() && test->empty())
            throw CLI::ValidationError("diagnose", "what? give a recorded test, or --test ID");
        if (test->empty() && model->empty()) throw CLI::RequiredError("--model");
        status = run_diagnose(*diagnose);
    });
}

}  // namespace

void add_model_commands(CLI::App& app, int& status) {
    add_simulate(app, status);
    add_calibrate(app, status);
    add_diagnose(app, status);
}

}  // namespace thermbal
