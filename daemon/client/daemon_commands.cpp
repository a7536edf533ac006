#include <memory>

#include "ask.hpp"
#include "commands.hpp"
#include "dashboard_command.hpp"
#include "watch.hpp"

namespace thermbal {
namespace {

constexpr char group[] = "Ask a running daemon";

/// The flags of all, in a place that lives as long as the command.
template <typename Options>
std::shared_ptr<Options> keep() {
    return std::make_shared<Options>();
}

struct Command {
    CLI::App* app;
    std::shared_ptr<AskOptions> ask;
};

Command add_command(CLI::App& app, const char* name, const char* what, const char* json_help = nullptr) {
    Command command{app.add_subcommand(name, what), keep<AskOptions>()};
    command.app->group(group);
    command.app->add_option("--socket", command.ask->socket, "the daemon's Unix socket")
        ->capture_default_str()
        ->envname("THERMBAL_SOCKET");
    command.app->add_flag("--json", command.ask->json,
                          json_help != nullptr ? json_help : "one JSON document on standard output");
    return command;
}

void add_simple(CLI::App& app, int& status, const char* name, const char* what,
                int (*run)(const AskOptions&)) {
    const Command command = add_command(app, name, what);
    command.app->callback([&status, run, ask = command.ask] { status = run(*ask); });
}

void add_watch(CLI::App& app, int& status) {
    const Command command = add_command(app, "watch", "watch all channels live",
                                        "one JSON document a line: {\"topic\": ..., \"params\": ...}");
    command.app->footer(
        "In a terminal a full screen: arrow keys and Enter show one channel, e the events, ? the keys, q "
        "quits. Piped, "
        "one line a\n"
        "scan and an event. Goes on when the daemon restarts. NO_COLOR=1 turns colours off.");
    command.app->callback([&status, ask = command.ask] { status = run_watch(*ask); });
}

void add_dashboard(CLI::App& app, int& status) {
    const auto command = keep<DashboardCommand>();
    command->socket = default_socket;
    CLI::App& dashboard = *app.add_subcommand("dashboard", "a web page on the running test, live, read only");
    dashboard.group(group);
    dashboard.add_option("--socket", command->socket, "the daemon's Unix socket")
        ->capture_default_str()
        ->envname("THERMBAL_SOCKET");
    dashboard.add_option("--listen", command->listen, "ADDRESS:PORT; port 0: a free one")
        ->capture_default_str();
    dashboard.add_flag("--beyond-this-machine", command->beyond_this_machine,
                       "an address that is not loopback is meant; needs --token-file, and is not encrypted");
    dashboard.add_option("--token-file", command->token_file,
                         "file with the token that a reader has to give: /?token=...");
    dashboard.add_option("--host", command->hosts,
                         "a further name that the page is opened under; several times for several");
    dashboard.add_option("--most-readers", command->most_readers, "pages open at the same time")
        ->capture_default_str()
        ->check(CLI::Range(1, 100));
    dashboard.callback([&status, command] { status = run_dashboard(*command); });
}

void add_curve(CLI::App& app, int& status) {
    const Command command = add_command(app, "curve", "RMSE against the number of lags n, minimum marked");
    const auto channel = keep<std::string>();
    command.app->add_option("--channel", *channel, "only this channel; all without it");
    command.app->callback([&status, ask = command.ask, channel] { status = run_curve(*ask, *channel); });
}

void add_samples(CLI::App& app, int& status) {
    const Command command =
        add_command(app, "samples", "the scans of the test, raw registers and quality with --json");
    const auto options = keep<SamplesOptions>();
    command.app->add_option("--channel", options->channel, "only this channel; all without it");
    command.app->add_option("--from-scan", options->from_scan, "first scan, counted from 0")
        ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 40));
    command.app->add_option("--limit", options->limit, "at most so many scans")
        ->capture_default_str()
        ->check(CLI::Range(1, 10'000));
    command.app->callback([&status, ask = command.ask, options] { status = run_samples(*ask, *options); });
}

void add_events(CLI::App& app, int& status) {
    const Command command =
        add_command(app, "events", "what happened: starts, declarations, trouble, annotations",
                    "one JSON document on standard output; with --follow one a line");
    const auto options = keep<EventsOptions>();
    command.app->add_option("--after", options->after_id, "only events after the one with this id")
        ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 60));
    command.app->add_option("--limit", options->limit, "at most so many, the newest")
        ->capture_default_str()
        ->check(CLI::Range(1, 10'000));
    command.app->add_flag("--follow", options->follow, "go on with what happens from now on");
    command.app->callback([&status, ask = command.ask, options] { status = run_events(*ask, *options); });
}

void add_start(CLI::App& app, int& status) {
    const Command command = add_command(app, "start", "start a test (operators only)");
    const auto options = keep<StartOptions>();
    command.app->add_option("--name", options->name, "name of the test; otherwise as configured");
    command.app->add_option("--machine", options->machine, "the machine under test; otherwise as configured");
    command.app->add_option("--model", options->model,
                            "simulation model (TOML) that the test is compared with while it runs");
    command.app->add_option("--input", options->inputs,
                            "a known input, spindle_rpm=5000; may be given several times");
    command.app->callback([&status, ask = command.ask, options] { status = run_start(*ask, *options); });
}

void add_inputs(CLI::App& app, int& status) {
    const Command command =
        add_command(app, "inputs", "known inputs have other values from now on (operators only)");
    const auto inputs = keep<std::vector<std::string>>();
    command.app->add_option("NAME=VALUE", *inputs, "spindle_rpm=3000")->required();
    command.app->callback([&status, ask = command.ask, inputs] { status = run_inputs(*ask, *inputs); });
}

void add_stop(CLI::App& app, int& status) {
    const Command command = add_command(app, "stop", "stop the running test by hand (operators only)");
    const auto reason = keep<std::string>();
    const auto abort = keep<bool>();
    command.app->add_option("--reason", *reason, "why, for the record");
    command.app->add_flag("--abort", *abort, "the test has no result");
    command.app->callback(
        [&status, ask = command.ask, reason, abort] { status = run_stop(*ask, *reason, *abort); });
}

void add_annotate(CLI::App& app, int& status) {
    const Command command = add_command(app, "annotate", "write a remark into the record (operators only)");
    const auto message = keep<std::string>();
    const auto channel = keep<std::string>();
    command.app->add_option("TEXT", *message, "the remark")->required();
    command.app->add_option("--channel", *channel, "the channel it is about");
    command.app->callback(
        [&status, ask = command.ask, message, channel] { status = run_annotate(*ask, *message, *channel); });
}

}  // namespace

void add_daemon_commands(CLI::App& app, int& status) {
    add_watch(app, status);
    add_dashboard(app, status);
    add_simple(app, status, "status", "state of the daemon and of its test", run_status);
    add_simple(app, status, "channels", "all channels: value, rise, rate, prediction, state", run_channels);
    add_simple(app, status, "predictions", "where each channel will settle, how sure, and why",
               run_predictions);
    add_curve(app, status);
    add_samples(app, status);
    add_events(app, status);
    add_simple(app, status, "health", "scans, lines, commits, identification, memory", run_health);
    add_start(app, status);
    add_inputs(app, status);
    add_stop(app, status);
    add_annotate(app, status);
}

}  // namespace thermbal
