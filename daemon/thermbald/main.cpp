#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "abort_test.hpp"
#include "config/load.hpp"
#include "daemon.hpp"
#include "manual/flags.hpp"
#include "manual/manual.hpp"
#include "manual/standard_streams.hpp"
#include "model_watch.hpp"
#include "version.hpp"

namespace {

using namespace thermbal;

struct Flags {
    std::string config = "/etc/thermbal/thermbald.toml";
    std::vector<std::string> profiles;
    bool check = false;
    double time_scale = 1.0;
    std::int64_t time_epoch_ns = -1;
    bool lockstep = false;
    bool exit_when_ended = false;
    bool abort_test = false;
};

/// In a sandbox that hides /proc/sys the unit says it. Without either, every start counts as a boot of its
/// own: the wall clock then joins the scans of a resumed test, which is less exact and never wrong.
std::string boot_id() {
    std::ifstream file("/proc/sys/kernel/random/boot_id");
    std::string id;
    if (std::getline(file, id) && !id.empty()) return id;
    // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody here sets variables
    if (const char* told = std::getenv("THERMBAL_BOOT_ID"); told != nullptr && *told != '\0') return told;
    return fmt::format("unknown, process {} of {}", getpid(), system_clock()->wall_ns());
}

/// The clock, and a name for it: monotonic times of another clock mean nothing on this one.
std::pair<std::unique_ptr<Clock>, std::string> make_clock(const Flags& flags) {
    if (flags.lockstep) {
        const auto real = system_clock();
        return {lockstep_clock(0, real->wall_ns()), fmt::format("lockstep {}", real->wall_ns())};
    }
    if (flags.time_scale != 1.0 || flags.time_epoch_ns >= 0) {
        const std::int64_t epoch_ns = flags.time_epoch_ns >= 0 ? flags.time_epoch_ns : real_monotonic_ns();
        return {scaled_clock(flags.time_scale, epoch_ns),
                fmt::format("{} x{} from {}", boot_id(), flags.time_scale, epoch_ns)};
    }
    return {system_clock(), boot_id()};
}

/// Signals are the event loop's: blocked here, before the first thread, so that no other thread takes one.
void leave_signals_to_the_loop() {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals, signal);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    std::signal(SIGPIPE, SIG_IGN);  // NOLINT(concurrency-mt-unsafe): no other thread yet
    // A limit on the size of files is a failed write, not the end of the measurement.
    std::signal(SIGXFSZ, SIG_IGN);  // NOLINT(concurrency-mt-unsafe)
}

/// An identification takes some megabytes for a second; without this they are kept for good, and a daemon
/// that runs for weeks looks as if it leaked. As many heaps as there are threads: two threads on one heap
/// wait for each other, and a scan would wait for a computation that the host keeps from running.
void give_memory_back(const Config& config) {
    const auto threads = static_cast<int>(config.lines.size()) + config.identification.workers + 5;
    mallopt(M_ARENA_MAX, threads);         // NOLINT(concurrency-mt-unsafe): no other thread yet
    mallopt(M_TRIM_THRESHOLD, 64 * 1024);  // NOLINT(concurrency-mt-unsafe)
}

/// That the machine can be stopped is seen to before it runs for hours.
Result<void> check_stop_command(const Config& config, const std::string& file) {
    if (config.stop.action != StopConfig::Action::command) return {};
    const std::string& program = config.stop.command.front();
    std::error_code error;
    const bool is_file = std::filesystem::is_regular_file(program, error);
    if (is_file && access(program.c_str(), X_OK) == 0) return {};
    return fail(
        NextStep::refuse_input,
        fmt::format("{}: stop.command: {}: {}; accepted: the full path of a program that thermbald may run",
                    file, program,
                    is_file                                   ? "may not be executed"
                    : std::filesystem::exists(program, error) ? "is no file"
                                                              : "is not there"));
}

int status_of(const Error& error) {
    return error.next == NextStep::refuse_input ? 2 : 1;
}

int refused(const Error& error) {
    print_error_line(error.message);
    return status_of(error);
}

int answered(const std::string& text) {
    const auto printed = print_out(text);
    return printed ? 0 : refused(printed.error());
}

}  // namespace

// What nobody expects to be thrown ends the program with what it says.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
    keep_standard_streams();
    CLI::App app(
        "Polls a temperature module during a thermal-balance test, declares where each channel will settle, "
        "and stops "
        "the test.",
        "thermbald");
    Flags flags;
    app.set_version_flag("--version", std::string("thermbald ") + version);
    app.add_option("--config", flags.config, "configuration file")->capture_default_str();
    std::string checked_file;
    auto* check =
        app.add_option("--check-config", checked_file,
                       "check this configuration (without a file: that of --config), print what is in "
                       "effect, and end")
            ->expected(0, 1);
    app.add_option("--profiles", flags.profiles, "a further folder with module profiles, looked up first");
    app.add_flag(
           "--abort-test", flags.abort_test,
           "end the test that is open in the database as aborted, and end: where the configuration that it "
           "was begun with is gone; the machine is not stopped")
        ->excludes(check);
    app.add_flag("--exit-when-ended", flags.exit_when_ended,
                 "end when a test has ended (demonstrations, tests)");
    CLI::Option_group& time = *app.add_option_group("time", "Faster than time, with a simulated module:");
    auto* scale = time.add_option("--time-scale", flags.time_scale, "run the clock so many times as fast")
                      ->check(number_in(0.01, 100000.0));
    time.add_option("--time-epoch-ns", flags.time_epoch_ns, "CLOCK_MONOTONIC at which the scaled time is 0")
        ->needs(scale);
    time.add_flag("--lockstep", flags.lockstep, "the next scan is due when the work of the last one is done")
        ->excludes(scale);
    add_manual_flags(
        app, {.section = 8,
              .files = "/etc/thermbal/thermbald.toml: the configuration\n.br\n/var/lib/thermbal/thermbal.db: "
                       "the database\n.br\n/run/thermbal/thermbald.sock: the socket\n",
              .see_also = "thermbalctl(1), thermbald.toml(5), thermbal-mqtt(8)"});
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? answered("") : 2;
    }
    flags.check = check->count() > 0;
    if (!checked_file.empty()) flags.config = checked_file;

    auto config = load_config_file(flags.config, profiles_in(profile_folders(flags.profiles)));
    if (!config) return refused(config.error());
    if (flags.lockstep && config->lines.size() > 1) {
        return refused({NextStep::refuse_input,
                        fmt::format("{}: --lockstep needs a configuration with one line, found {}",
                                    flags.config, config->lines.size())});
    }
    if (!config->test.model.empty()) {
        const auto model = read_test_model(config->test.model, *config, config->test.inputs);
        if (!model) return refused(model.error());
    }
    if (const auto runs = check_stop_command(*config, flags.config); !runs) return refused(runs.error());
    if (flags.check) return answered(explain_config(*config));

    if (flags.abort_test) {
        const auto clock = system_clock();
        const auto done = abort_open_test(config->store.path, {clock->wall_ns(), clock->monotonic_ns()});
        if (!done) return refused(done.error());
        return answered(*done + "\n");
    }

    spdlog::set_default_logger(spdlog::stderr_logger_mt("thermbald"));
    spdlog::set_level(spdlog::level::from_str(config->log.level));
    // Under systemd the journal stamps every line.
    // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody here sets variables
    spdlog::set_pattern(std::getenv("JOURNAL_STREAM") != nullptr ? "%l: %v" : "%Y-%m-%dT%H:%M:%S.%e %l: %v");

    leave_signals_to_the_loop();
    give_memory_back(*config);
    auto [clock, clock_name] = make_clock(flags);
    auto daemon = Daemon::create({std::move(*config), version, clock_name, flags.exit_when_ended}, *clock);
    if (!daemon) return refused(daemon.error());
    if (const auto ended = (*daemon)->run(); !ended) {
        spdlog::critical("{}", ended.error().message);
        return status_of(ended.error());
    }
    return 0;
}
