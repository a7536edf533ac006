#include <memory>

#include "commands.hpp"
#include "database.hpp"
#include "manual/flags.hpp"
#include "serial_ports.hpp"
#include "track_record.hpp"

namespace thermbal {
namespace {

constexpr char group[] = "On the database, and on this machine";

CLI::App& add_command(CLI::App& app, const char* name, const char* what) {
    CLI::App& command = *app.add_subcommand(name, what);
    command.group(group);
    return command;
}

void add_json_flag(CLI::App& command, bool& json) {
    command.add_flag("--json", json, "one JSON document on standard output");
}

void add_tests(CLI::App& app, int& status) {
    CLI::App& command = add_command(app, "tests", "the stored tests, newest first");
    const auto options = std::make_shared<DatabaseOptions>();
    const auto limit = std::make_shared<std::int64_t>(500);
    command.add_option("--limit", *limit, "at most so many, the newest")
        ->capture_default_str()
        ->check(CLI::Range(1, 1'000'000));
    add_database_flags(command, *options);
    add_json_flag(command, options->ask.json);
    command.callback([&status, options, limit] { status = run_tests(*options, *limit); });
}

void add_export(CLI::App& app, int& status) {
    CLI::App& command = add_command(app, "export", "a test as CSV");
    const auto options = std::make_shared<DatabaseOptions>();
    const auto csv = std::make_shared<std::string>();
    const auto test = std::make_shared<std::optional<std::int64_t>>();
    command.add_option("--csv", *csv, "file to write, or - for standard output")->required();
    command.add_option("--test", *test, "id of the test (see thermbalctl tests); without it the newest")
        ->check(CLI::PositiveNumber);
    add_database_flags(command, *options);
    command.callback([&status, options, csv, test] { status = run_export(*options, *test, *csv); });
}

void add_verify(CLI::App& app, int& status) {
    CLI::App& command =
        add_command(app, "verify", "check a database; status 1 when anything is wrong with it");
    const auto options = std::make_shared<DatabaseOptions>();
    add_database_flags(command, *options);
    add_json_flag(command, options->ask.json);
    command.callback([&status, options] { status = run_verify(*options); });
}

void add_backup(CLI::App& app, int& status) {
    CLI::App& command = add_command(app, "backup", "a consistent copy, also while the daemon writes");
    const auto options = std::make_shared<DatabaseOptions>();
    const auto copy = std::make_shared<std::string>();
    command.add_option("OUT", *copy, "the copy; must not exist")->required();
    add_database_flags(command, *options);
    add_json_flag(command, options->ask.json);
    command.callback([&status, options, copy] { status = run_backup(*options, *copy); });
}

void add_track_record(CLI::App& app, int& status) {
    CLI::App& command = add_command(app, "track-record",
                                    "every declaration made with keep_measuring, against what then happened");
    const auto options = std::make_shared<TrackRecordOptions>();
    command
        .add_option("--tolerance-C", options->tolerance_C,
                    "how close a prediction has to be for the earliest honest time")
        ->capture_default_str()
        ->check(number_in(0.01, 10.0));
    add_database_flags(command, options->database);
    add_json_flag(command, options->database.ask.json);
    command.callback([&status, options] { status = run_track_record(*options); });
}

void add_ports(CLI::App& app, int& status) {
    CLI::App& command =
        add_command(app, "ports", "the serial ports: path, VID:PID, serial number, description");
    const auto json = std::make_shared<bool>(false);
    add_json_flag(command, *json);
    command.callback([&status, json] { status = run_ports(*json); });
}

}  // namespace

void add_database_flags(CLI::App& command, DatabaseOptions& options) {
    command.add_option("--database", options.database, "the database; without it the running daemon's own")
        ->check(CLI::ExistingFile);
    command.add_option("--socket", options.ask.socket, "the daemon's Unix socket")
        ->capture_default_str()
        ->envname("THERMBAL_SOCKET");
}

void add_database_commands(CLI::App& app, int& status) {
    add_tests(app, status);
    add_export(app, status);
    add_verify(app, status);
    add_backup(app, status);
    add_track_record(app, status);
    add_ports(app, status);
}

}  // namespace thermbal
