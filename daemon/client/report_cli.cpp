#include <memory>

#include "commands.hpp"
#include "manual/flags.hpp"
#include "report_command.hpp"

namespace thermbal {

void add_report_command(CLI::App& app, int& status) {
    const auto options = std::make_shared<ReportOptions>();
    CLI::App& command = *app.add_subcommand("report", "a test as one HTML file that needs nothing else");
    command.group("On the database, and on this machine");
    command.add_option(
        "TEST|FILE.csv", options->what,
        "id of a stored test, or a recorded test, which is run through the live flow; without it the "
        "newest test");
    auto* const out =
        command.add_option("--out", options->out, "HTML file to write, or - for standard output");
    command.add_flag("--json", options->json, "the same as one JSON document on standard output");
    add_database_flags(command, options->database);
    command
        .add_option("--ambient", options->recording.ambient,
                    "of a file: channel that measures the room, or none")
        ->capture_default_str();
    command.add_option("--archive", options->recording.archive,
                       "of a file: database with earlier tests of the machine");
    command.add_option("--machine", options->recording.machine,
                       "of a file: whose earlier tests in the archive");
    command
        .add_option("--tolerance-C", options->recording.tolerance_C,
                    "of a file: half width of the 90 % interval asked for")
        ->capture_default_str()
        ->check(number_in(0.01, 10.0));
    command
        .add_option("--every-min", options->recording.every_min,
                    "of a file: minutes of samples between two identifications")
        ->capture_default_str()
        ->check(number_in(0.01, 1e6));
    command.add_flag("--modes-only", options->recording.modes_only,
                     "of a file: the shared modes alone, without the SVR criterion (a study)");
    command.add_option("--threads", options->recording.threads, "compute threads")
        ->capture_default_str()
        ->check(CLI::Range(1, 256));
    command.callback([&status, options, out] {
        if (out->empty() && !options->json)
            throw CLI::ValidationError("report", "where to? give --out report.html, or --json");
        options->recording.file = options->what;
        status = run_report(*options);
    });
}

}  // namespace thermbal
