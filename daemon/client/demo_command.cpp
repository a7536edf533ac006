#include <memory>

#include "commands.hpp"
#include "demo.hpp"

namespace thermbal {

void add_demo_command(CLI::App& app, int& status) {
    CLI::App& command =
        *app.add_subcommand("demo", "a whole test on a simulated module, faster than time, without root");
    command.group("Set up");
    const auto options = std::make_shared<DemoOptions>();
    command.add_option("--condition", options->condition, "5000-idle, 3000-idle or 3000-cutting")
        ->capture_default_str();
    command.add_flag("--rtu", options->rtu, "Modbus RTU on a pseudo-terminal instead of TCP");
    command.add_option(
        "--keep", options->folder,
        "leave configuration, database and recording in this folder; without it everything is removed");
    command.callback([&app, &status, options] {
        const auto is_report = [](const CLI::App* one) { return one->get_name() == "report"; };
        options->report = !app.get_subcommands(is_report).empty();
        status = run_demo(*options);
    });
}

}  // namespace thermbal
