#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "config/load.hpp"
#include "manual/manual.hpp"
#include "manual/standard_streams.hpp"
#include "publish/secrets.hpp"
#include "publisher.hpp"
#include "version.hpp"

namespace {

using namespace thermbal;

volatile std::sig_atomic_t asked_to_end = 0;

struct Flags {
    std::string config = "/etc/thermbal/thermbald.toml";
    std::vector<std::string> profiles;
    std::string database;
    std::string position_file;
    bool once = false;
};

std::string variable(const char* name) {
    const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nobody here sets variables
    return value == nullptr ? "" : value;
}

std::string host_name() {
    char name[256] = {};
    return gethostname(name, sizeof name - 1) == 0 ? name : "host";
}

int refused(const Error& error) {
    print_error_line("thermbal-mqtt: " + error.message);
    return error.next == NextStep::refuse_input ? 2 : 1;
}

/// Files and names that a person left out, and the password from its file.
Result<BrokerOptions> broker_options(const Config& config, const std::string& file) {
    if (!config.mqtt)
        return fail(NextStep::refuse_input,
                    fmt::format("{}: there is no section [mqtt]; name the broker there", file));
    const std::string credentials = variable("CREDENTIALS_DIRECTORY");
    BrokerOptions broker;
    broker.mqtt = *config.mqtt;
    MqttConfig& mqtt = broker.mqtt;
    if (mqtt.machine.empty()) mqtt.machine = config.test.machine.empty() ? host_name() : config.test.machine;
    if (mqtt.machine.size() > 1000)
        return fail(NextStep::refuse_input,
                    fmt::format("{}: mqtt.machine: accepted: at most 1000 bytes", file));
    if (mqtt.client_id.empty())
        mqtt.client_id = fmt::format("thermbal-{}-{}", host_name(), topic_level(mqtt.machine));
    const auto resolve = [&](const std::string& name, std::string& path) -> Result<void> {
        auto found = secret_path(name, credentials);
        if (!found) return std::unexpected(found.error());
        path = std::move(*found);
        return {};
    };
    if (auto done = resolve(mqtt.ca_file, broker.ca_path); !done) return std::unexpected(done.error());
    if (auto done = resolve(mqtt.certificate_file, broker.certificate_path); !done)
        return std::unexpected(done.error());
    if (auto done = resolve(mqtt.key_file, broker.key_path); !done) return std::unexpected(done.error());
    if (mqtt.password_file.empty()) return broker;
    auto password = read_secret(mqtt.password_file, credentials);
    if (!password) return std::unexpected(password.error());
    broker.password = std::move(*password);
    return broker;
}

std::string default_position_file() {
    const std::string folder = variable("STATE_DIRECTORY");
    return (folder.empty() ? "/var/lib/thermbal-mqtt" : folder) + "/position.json";
}

int run(Publisher& publisher, bool once) {
    while (asked_to_end == 0 && !(once && publisher.all_sent())) {
        if (const auto done = publisher.turn(); !done) {
            publisher.end(false);
            return refused(done.error());
        }
    }
    publisher.end(once && publisher.all_sent());
    return 0;
}

}  // namespace

// What nobody expects to be thrown ends the program with what it says.
// NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
    keep_standard_streams();
    CLI::App app("Sends what thermbald stores to an MQTT broker: samples, declarations, events, the state.",
                 "thermbal-mqtt");
    Flags flags;
    app.set_version_flag("--version", std::string("thermbal-mqtt ") + version);
    app.add_option("--config", flags.config, "the daemon's configuration, with a section [mqtt]")
        ->capture_default_str();
    app.add_option("--profiles", flags.profiles, "a further folder with module profiles, looked up first");
    app.add_option("--database", flags.database, "the database; without it the one of the configuration");
    app.add_option(
        "--position-file", flags.position_file,
        "keeps how far the broker has acknowledged; without it position.json in $STATE_DIRECTORY or "
        "/var/lib/thermbal-mqtt");
    app.add_flag("--once", flags.once, "send what there is, wait until it is acknowledged, and end");
    app.footer("Exit status: 0 done, 1 failed, 2 wrong usage or a configuration that is refused.");
    add_manual_flags(app,
                     {.section = 8,
                      .files = "/etc/thermbal/thermbald.toml: the configuration, its section [mqtt]\n.br\n"
                               "/var/lib/thermbal-mqtt/position.json: how far the broker has acknowledged\n",
                      .see_also = "thermbald(8), thermbald.toml(5), mosquitto(8)"});
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    const auto config = load_config_file(flags.config, profiles_in(profile_folders(flags.profiles)));
    if (!config) return refused(config.error());
    auto broker = broker_options(*config, flags.config);
    if (!broker) return refused(broker.error());

    spdlog::set_default_logger(spdlog::stderr_logger_mt("thermbal-mqtt"));
    spdlog::set_level(spdlog::level::from_str(config->log.level));
    spdlog::set_pattern(variable("JOURNAL_STREAM").empty() ? "%Y-%m-%dT%H:%M:%S.%e %l: %v" : "%l: %v");
    if (!broker->password.empty() && !broker->mqtt.tls)
        spdlog::warn("broker {}: the password crosses the network unencrypted: set tls = true",
                     broker->mqtt.host);
    std::signal(SIGPIPE, SIG_IGN);
    for (const int signal : {SIGTERM, SIGINT}) std::signal(signal, [](int) { asked_to_end = 1; });

    Topics topics(broker->mqtt.topic_prefix, broker->mqtt.machine);
    Publisher publisher({std::move(*broker), std::move(topics),
                         flags.database.empty() ? config->store.path : flags.database,
                         flags.position_file.empty() ? default_position_file() : flags.position_file,
                         config->service.socket, version});
    return run(publisher, flags.once);
}
