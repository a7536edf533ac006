#include "demo.hpp"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "address.hpp"
#include "child_process.hpp"
#include "columns.hpp"
#include "fields.hpp"
#include "files.hpp"
#include "new_configuration.hpp"
#include "output.hpp"
#include "socket_client.hpp"
#include "store/reader.hpp"

namespace thermbal {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;
namespace fs = std::filesystem;

volatile std::sig_atomic_t interrupted = 0;

std::unexpected<Error> trouble(const std::string& what) {
    return fail(NextStep::stop, what);
}

/// A folder of our own, removed with all that is in it unless a person wants it.
class DemoFolder {
  public:
    static Result<DemoFolder> make(const std::string& wanted) {
        std::error_code error;
        if (!wanted.empty()) {
            const fs::path path = fs::absolute(wanted, error);
            fs::create_directories(path, error);
            if (error) return trouble(fmt::format("{}: {}", wanted, error.message()));
            if (fs::exists(path / "thermbal.db", error))
                return fail(NextStep::refuse_input,
                            fmt::format("{}: holds a test already; name another folder", wanted));
            return DemoFolder(path, true);
        }
        std::string name = (fs::temp_directory_path(error) / "thermbal-demo-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr)
            return trouble(fmt::format("{}: no folder can be made there", name));
        return DemoFolder(name, false);
    }
    DemoFolder(DemoFolder&& other) noexcept : path_(std::move(other.path_)), keep_(other.keep_) {
        other.keep_ = true;
    }
    DemoFolder& operator=(DemoFolder&&) = delete;
    ~DemoFolder() {
        std::error_code ignored;
        if (!keep_) fs::remove_all(path_, ignored);
    }
    std::string operator/(const char* name) const { return (path_ / name).string(); }
    const fs::path& path() const { return path_; }
    bool stays() const { return keep_; }

  private:
    DemoFolder(fs::path path, bool keep) : path_(std::move(path)), keep_(keep) {}
    fs::path path_;
    bool keep_;
};

std::string program(const char* name) {
    std::error_code none;
    return (fs::read_symlink("/proc/self/exe", none).parent_path() / name).string();
}

/// What the simulated machine would really come to: a list of channel, node, steady_state_C,
/// equilibrium_time_min.
Result<json> truth_of(const std::string& condition) {
    auto sim =
        ChildProcess::start({program("thermbal-sim"), "--truth", "--json", "--condition", condition}, true);
    if (!sim) return std::unexpected(sim.error());
    const json truth = json::parse(sim->read_all(seconds(20)), nullptr, false);
    if (list(truth, "channels").empty())
        return fail(NextStep::refuse_input,
                    fmt::format("--condition: found \"{}\"; `thermbal-sim --help` lists them", condition));
    return list(truth, "channels");
}

/// "ready tcp 127.0.0.1:41873 [::1]:41873" or "ready rtu /dev/pts/3" of thermbal-sim as a line to it.
Result<LinkOptions> link_to(const std::string& announcement) {
    LinkOptions link;
    const std::size_t where = announcement.find(' ', announcement.find(' ') + 1);
    const std::string address = where == std::string::npos ? "" : announcement.substr(where + 1);
    if (announcement.starts_with("ready rtu ")) {
        link.transport = Transport::rtu;
        link.device = address;
        link.baud = 19200;
        return link;
    }
    const auto first = network_address(address.substr(0, address.find(' ')));
    if (!announcement.starts_with("ready tcp ") || !first || !first->port)
        return trouble(fmt::format("thermbal-sim: found \"{}\" where its address is expected", announcement));
    link.port = *first->port;
    return link;
}

NewConfiguration demo_configuration(const DemoFolder& folder, const DemoOptions& options,
                                    const LinkOptions& link, const json& truth) {
    NewConfiguration wanted;
    wanted.test_name = options.condition;
    wanted.machine = "simulated spindle head";
    wanted.start_automatically = true;
    wanted.database = folder / "thermbal.db";
    wanted.socket = folder / "thermbald.sock";
    wanted.log_level = "warning";
    // Faster than time: the sweep over n only where nothing else speaks against a declaration.
    wanted.sweep_always = false;
    wanted.stop_toml =
        "action = \"write_coil\"        # clearing coil 0 stops the simulated spindle\nline = "
        "\"line\"\nunit_id = "
        "1\naddress = 0\nvalue = 0\n";
    wanted.link = link;
    wanted.units = {{1, "generic-16x-int16"}};
    wanted.channels = channels_of_inputs({static_cast<int>(truth.size())}, truth.size(), "T1");
    for (std::size_t i = 0; i < truth.size(); ++i) {
        wanted.channels[i].place = text(truth[i], "node");
        std::ranges::replace(wanted.channels[i].place, '_', ' ');
    }
    return wanted;
}

Result<SocketClient> connect_when_there(const std::string& socket, ChildProcess& daemon) {
    while (true) {
        auto client = SocketClient::connect(socket);
        if (client || interrupted != 0) return client;
        if (const auto status = daemon.ended())
            return trouble(fmt::format("thermbald ended with status {}", *status));
        std::ignore = daemon.read_line(milliseconds(20));
    }
}

void show_scan(const json& scan, double& shown_min) {
    constexpr double every_min = 15.0;
    const auto time_min = number(scan, "time_min");
    if (!time_min || *time_min < shown_min + every_min) return;
    shown_min = *time_min;
    std::string line = fmt::format("{:7.1f} min ", *time_min);
    std::size_t shown = 0;
    for (const json& channel : list(scan, "channels")) {
        if (++shown > 8) break;
        const auto value_C = number(channel, "value_C");
        line += " " + text(channel, "channel") + " " +
                (value_C ? fixed(value_C, 1) : text(channel, "quality")) + " ";
    }
    print_text(line + "... C\n");
}

void show_event(const json& event) {
    const std::string kind = text(event, "kind");
    for (const char* told :
         {"declared", "renewed", "withdrawn", "all_declared", "held", "stopped", "aborted", "line_trouble"})
        if (kind == told)
            print_text(fmt::format("{:7.1f} min  {}\n", number(event, "time_s").value_or(0.0) / 60.0,
                                   printable(text(event, "message"))));
}

/// Until the daemon ends with its test.
Result<void> watch_the_test(const std::string& socket, ChildProcess& daemon) {
    auto client = connect_when_there(socket, daemon);
    if (interrupted != 0) return trouble("interrupted");
    if (!client) return std::unexpected(client.error());
    if (auto subscribed = client->subscribe({"scan", "event"}); !subscribed) return subscribed;
    double shown_min = -15.0;
    while (interrupted == 0) {
        const auto news = client->next(milliseconds(200));
        if (!news) break;  // the daemon is gone: with the test, or the status says why
        if (!*news) continue;
        (*news)->topic == "scan" ? show_scan((*news)->params, shown_min) : show_event((*news)->params);
    }
    if (interrupted != 0) return trouble("interrupted");
    // Its output has ended before it has: it still closes its database.
    for (int waited = 0; !daemon.ended() && waited < 600; ++waited)
        std::this_thread::sleep_for(milliseconds(100));
    if (daemon.ended() != 0)
        return trouble(fmt::format("thermbald ended with status {}", daemon.ended().value_or(-1)));
    return {};
}

struct Outcome {
    std::string table;
    std::size_t declared = 0;
    double worst_C = 0.0;
};

Outcome compare_with_truth(const std::vector<DeclarationRecord>& declarations, const json& truth) {
    TextTable table({{"channel"},
                     {"place"},
                     {"declared at", true},
                     {"settles at", true},
                     {"90 % interval", true},
                     {"really", true},
                     {"off by", true},
                     {"95 % at", true},
                     {"really", true}});
    Outcome outcome;
    for (const json& plant : truth) {
        const std::string channel = text(plant, "channel");
        const auto stands = [&](const DeclarationRecord& one) {
            return one.channel == channel && one.withdrawn.empty();
        };
        const auto found = std::ranges::find_if(declarations, stands);
        std::string place = text(plant, "node");
        std::ranges::replace(place, '_', ' ');
        if (found == declarations.end()) {
            table.add({channel, place, "-", "-", "-", fixed(number(plant, "steady_state_C"), 2) + " C", "-",
                       "-", "-"});
            continue;
        }
        const double off_C = found->steady_state_C - number(plant, "steady_state_C").value_or(no_value);
        ++outcome.declared;
        outcome.worst_C = std::max(outcome.worst_C, std::abs(off_C));
        table.add({channel, place, fmt::format("{:.0f} min", found->declared_at_min),
                   fmt::format("{:.2f} C", found->steady_state_C),
                   fmt::format("{:.2f} to {:.2f} C", found->steady_state_low_C, found->steady_state_high_C),
                   fixed(number(plant, "steady_state_C"), 2) + " C", fmt::format("{:+.2f} C", off_C),
                   minutes(found->equilibrium_time_min), minutes(number(plant, "equilibrium_time_min"))});
    }
    outcome.table = table.str();
    return outcome;
}

Result<int> show_outcome(const DemoFolder& folder, const json& truth) {
    const auto reader = Reader::open(folder / "thermbal.db");
    if (!reader) return std::unexpected(reader.error());
    const auto test = reader->newest_test();
    if (!test) return std::unexpected(test.error());
    if (!*test) return trouble("the daemon stored no test");
    const auto declarations = reader->declarations((*test)->id);
    if (!declarations) return std::unexpected(declarations.error());
    const auto csv = reader->csv((*test)->id);
    if (!csv) return std::unexpected(csv.error());
    if (auto written = write_file(folder / "recording.csv", *csv); !written)
        return std::unexpected(written.error());
    const Outcome outcome = compare_with_truth(*declarations, truth);
    const double end_min =
        static_cast<double>((*test)->last_scan.value_or(0)) * (*test)->record.period_s / 60.0;
    print_text(fmt::format(
        "\n{}\n{} at {:.0f} min: {}\n{} channels declared, the worst {:.2f} C off. A test run to its "
        "end takes 400 min.\n",
        outcome.table, to_string((*test)->state), end_min, (*test)->stop_reason, outcome.declared,
        outcome.worst_C));
    return (*test)->state == TestState::stopped && outcome.declared > 0 ? 0 : 1;
}

/// `thermbalctl report` as a person would call it.
void write_report(const DemoFolder& folder) {
    auto report = ChildProcess::start({program("thermbalctl"), "report", "--database", folder / "thermbal.db",
                                       "--out", folder / "report.html"},
                                      true);
    if (report) std::ignore = report->read_all(seconds(120));
}

Result<int> demonstrate(const DemoFolder& folder, const DemoOptions& options) {
    const auto truth = truth_of(options.condition);
    if (!truth) return std::unexpected(truth.error());
    std::vector<std::string> words = {program("thermbal-sim"), "--lockstep", "15", "--condition",
                                      options.condition};
    if (options.rtu) words.emplace_back("--rtu");
    auto sim = ChildProcess::start(words, true);
    if (!sim) return std::unexpected(sim.error());
    const auto link = link_to(sim->read_line(seconds(20)).value_or("nothing"));
    if (!link) return std::unexpected(link.error());
    print_text(
        fmt::format("simulated module on Modbus {}, {}; a scan each 15 s of simulated time; Ctrl-C ends it\n",
                    options.rtu ? "RTU, " + link->device : fmt::format("TCP, 127.0.0.1:{}", link->port),
                    options.condition));
    const std::string config = folder / "thermbald.toml";
    if (auto written =
            write_file(config, configuration_text(demo_configuration(folder, options, *link, *truth)));
        !written)
        return std::unexpected(written.error());
    auto daemon = ChildProcess::start(
        {program("thermbald"), "--config", config, "--lockstep", "--exit-when-ended"}, true);
    if (!daemon) return std::unexpected(daemon.error());
    if (auto watched = watch_the_test(folder / "thermbald.sock", *daemon); !watched)
        return std::unexpected(watched.error());
    if (folder.stays() && options.report) write_report(folder);
    return show_outcome(folder, *truth);
}

}  // namespace

int run_demo(const DemoOptions& options) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, [](int) { interrupted = 1; });
    const auto folder = DemoFolder::make(options.folder);
    if (!folder) return report_error(folder.error());
    const auto status = demonstrate(*folder, options);
    if (!status) return report_error(status.error());
    if (folder->stays())
        print_text(fmt::format("configuration, database, recording{}: {}\n",
                               options.report ? ", report.html" : "", folder->path().string()));
    return *status;
}

}  // namespace thermbal
