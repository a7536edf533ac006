#include <clocale>

#include "commands.hpp"
#include "manual/manual.hpp"
#include "manual/standard_streams.hpp"
#include "output.hpp"
#include "version.hpp"

namespace {

/// One line that says what was wrong and where to read on.
std::string one_line(const CLI::App* app, const CLI::Error& error) {
    std::string command = "thermbalctl";
    for (const CLI::App* sub : app->get_subcommands()) command += " " + sub->get_name();
    return "thermbalctl: " + std::string(error.what()) + "; see " + command + " --help\n";
}

}  // namespace

// What nobody expects to be thrown ends the program with what it says.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
    thermbal::keep_standard_streams();
    std::setlocale(LC_CTYPE, "");  // NOLINT(concurrency-mt-unsafe): before anything else runs
    CLI::App app("Asks a running thermbald over its socket, and does the same work offline on files.",
                 "thermbalctl");
    app.set_version_flag("--version", std::string("thermbalctl ") + thermbal::version);
    app.footer("thermbalctl COMMAND --help says more. Exit status: 0 done, 1 failed, 2 wrong usage.");
    app.failure_message(one_line);
    app.require_subcommand(1);
    int status = 0;
    thermbal::add_new_command(app, status);
    thermbal::add_demo_command(app, status);
    thermbal::add_daemon_commands(app, status);
    thermbal::add_metrics_command(app, status);
    thermbal::add_database_commands(app, status);
    thermbal::add_report_command(app, status);
    thermbal::add_probe_command(app, status);
    thermbal::add_offline_commands(app, status);
    thermbal::add_model_commands(app, status);
    thermbal::add_manual_flags(app, {.files = "/run/thermbal/thermbald.sock: the daemon's socket\n",
                                     .see_also = "thermbald(8), thermbal-sim(1), thermbald.toml(5)"});
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? thermbal::print_text("") : 2;
    }
    return status;
}
