#include <algorithm>
#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "commands.hpp"
#include "config/load.hpp"
#include "files.hpp"
#include "network_address.hpp"
#include "new_configuration.hpp"
#include "output.hpp"
#include "probe/scan.hpp"
#include "profile_files.hpp"
#include "questions.hpp"
#include "serial/ports.hpp"

namespace thermbal {
namespace {

constexpr std::size_t most_channels = 16;

struct NewFlags {
    std::string out = "thermbald.toml";
    std::string tcp;
    std::string rtu_over_tcp;
    std::string rtu;
    int baud = 0;
    std::string parity;
    std::vector<int> unit_ids;
    std::string profile;
    std::size_t channels = most_channels;
    std::string ambient = "T1";
    std::vector<std::string> places;
    std::string machine;
    std::string database;
    std::string socket;
    std::vector<std::string> profiles;
    bool probe = false;
    bool force = false;
    bool no_questions = false;

    bool names_a_line() const { return !tcp.empty() || !rtu_over_tcp.empty() || !rtu.empty(); }
};

std::unexpected<Error> refuse(std::string message) {
    return fail(NextStep::refuse_input, std::move(message));
}

// ---- what is not given is asked

std::string known_ports() {
    const auto ports = list_ports();
    std::string names;
    for (const PortInfo& port : ports ? *ports : std::vector<PortInfo>())
        names +=
            "  " + (port.by_id_path.empty() ? port.path : port.by_id_path) + "  " + port.description + "\n";
    return names.empty() ? "  (no serial port is there: is the adapter plugged in?)\n" : names;
}

Result<void> ask_for_line(NewFlags& flags) {
    const auto transport =
        Questions::ask("How is the module connected: tcp, rtu (serial), rtu_over_tcp (a gateway)", "tcp",
                       [](const std::string& answer) {
                           return answer == "tcp" || answer == "rtu" || answer == "rtu_over_tcp"
                                      ? ""
                                      : "accepted: tcp, rtu, rtu_over_tcp";
                       });
    if (!transport) return std::unexpected(transport.error());
    const bool serial = *transport == "rtu";
    if (serial) fmt::print(stderr, "Serial ports of this machine:\n{}", known_ports());
    const auto where =
        Questions::ask(serial ? "Port" : "Address and port of the module, HOST or HOST:PORT", "",
                       [](const std::string& answer) { return answer.empty() ? "accepted: a name" : ""; });
    if (!where) return std::unexpected(where.error());
    (serial ? flags.rtu : *transport == "tcp" ? flags.tcp : flags.rtu_over_tcp) = *where;
    return {};
}

Result<void> ask_for_the_rest(NewFlags& flags) {
    if (flags.machine.empty()) {
        auto machine = Questions::ask("Name of the machine", "");
        if (!machine) return std::unexpected(machine.error());
        flags.machine = *machine;
    }
    if (!flags.names_a_line()) {
        if (auto asked = ask_for_line(flags); !asked) return asked;
    }
    if (!flags.probe && flags.profile.empty()) {
        const auto probe = Questions::ask_yes_no(
            "Look at the module now, read only, to find its settings and register map", true);
        if (!probe) return std::unexpected(probe.error());
        flags.probe = *probe;
    }
    return {};
}

Result<void> ask_for_channels(NewConfiguration& wanted, const NewFlags& flags) {
    const std::size_t count = wanted.channels.size();
    const auto ambient = Questions::ask(
        fmt::format("Which channel measures the room, T1 ... T{}, or none", count), flags.ambient,
        [&](const std::string& answer) {
            const bool known = answer == "none" ||
                               std::ranges::find(wanted.channels, answer, &NewConfiguration::Channel::name) !=
                                   wanted.channels.end();
            return known ? std::string() : fmt::format("accepted: T1 ... T{}, none", count);
        });
    if (!ambient) return std::unexpected(ambient.error());
    for (NewConfiguration::Channel& channel : wanted.channels) {
        channel.ambient = channel.name == *ambient;
        const auto place =
            Questions::ask("Where is " + channel.name, channel.ambient ? "air at the machine" : "");
        if (!place) return std::unexpected(place.error());
        channel.place = *place;
    }
    return {};
}

// ---- from flags to a configuration

Result<LinkOptions> link_of(const NewFlags& flags) {
    if (!flags.tcp.empty()) return network_link(flags.tcp, Transport::tcp);
    if (!flags.rtu_over_tcp.empty()) return network_link(flags.rtu_over_tcp, Transport::rtu_over_tcp);
    if (flags.rtu.empty())
        return refuse("how is the module connected? --tcp HOST, --rtu DEVICE or --rtu-over-tcp HOST:PORT");
    LinkOptions link;
    link.transport = Transport::rtu;
    link.device = flags.rtu;
    if (flags.baud != 0) link.baud = flags.baud;
    if (!flags.parity.empty()) link.parity = flags.parity.front();
    return link;
}

ProbeOptions probe_options(const NewFlags& flags, LinkOptions link) {
    ProbeOptions options;
    link.name = "line";
    options.link = std::move(link);
    if (options.link.transport == Transport::rtu) {
        options.bauds =
            flags.baud != 0 ? std::vector{flags.baud} : std::vector{9600, 19200, 38400, 57600, 115200, 4800};
        options.parities = flags.parity.empty() ? "NE" : flags.parity;
    }
    if (!flags.unit_ids.empty()) {
        options.first_unit = std::ranges::min(flags.unit_ids);
        options.last_unit = std::ranges::max(flags.unit_ids);
    }
    options.profiles = profiles_there(flags.profiles);
    return options;
}

/// The profiles that fit, unit by unit, into `wanted`; returns how many inputs each has.
Result<std::vector<int>> look_at_the_module(const NewFlags& flags, NewConfiguration& wanted) {
    const ProbeResult result = probe(probe_options(flags, wanted.link));
    if (result.units.empty())
        return fail(NextStep::stop,
                    result.trouble.empty()
                        ? std::string("nobody answered: other unit ids, another speed or parity? "
                                      "thermbalctl probe asks for more")
                        : result.trouble.front());
    std::vector<int> inputs;
    for (const ProbedUnit& unit : result.units) {
        if (unit.fits.empty()) continue;
        const ModuleProfile& profile = unit.fits.front().profile;
        fmt::print(stderr, "unit {} answers, and reads like {}\n", unit.unit_id, profile.name);
        wanted.units.push_back({unit.unit_id, profile.name});
        inputs.push_back(profile.inputs);
    }
    if (inputs.empty())
        return fail(NextStep::stop,
                    "a module answers, and no known profile fits it: `thermbalctl probe` proposes one");
    const double timeout_s = wanted.link.response_timeout_s;
    wanted.link = result.units.front().link;
    wanted.link.response_timeout_s = timeout_s;
    return inputs;
}

Result<std::vector<int>> units_as_told(const NewFlags& flags, NewConfiguration& wanted) {
    std::string name = flags.profile;
    if (name.empty()) {
        std::vector<std::string> names;
        for (const ModuleProfile& profile : profiles_there(flags.profiles)) names.push_back(profile.name);
        if (!Questions::somebody_is_there() || flags.no_questions)
            return refuse(
                fmt::format("which module? --profile NAME of {}, or --probe", fmt::join(names, ", ")));
        fmt::print(stderr, "Profiles: {}\n", fmt::join(names, ", "));
        auto answer = Questions::ask("Which profile does the module have", "generic-16x-int16");
        if (!answer) return std::unexpected(answer.error());
        name = *answer;
    }
    const auto profile = profiles_in(profile_folders(flags.profiles))(name);
    if (!profile) return std::unexpected(profile.error());
    std::vector<int> inputs;
    for (const int unit_id : flags.unit_ids.empty() ? std::vector{1} : flags.unit_ids) {
        wanted.units.push_back({unit_id, name});
        inputs.push_back(profile->inputs);
    }
    return inputs;
}

Result<void> set_places(NewConfiguration& wanted, const std::vector<std::string>& places) {
    for (const std::string& text : places) {
        const std::size_t equal = text.find('=');
        const auto channel =
            std::ranges::find(wanted.channels, text.substr(0, equal), &NewConfiguration::Channel::name);
        if (equal == std::string::npos || channel == wanted.channels.end())
            return refuse(fmt::format("--place: found \"{}\"; accepted: T1=PLACE ... T{}=PLACE", text,
                                      wanted.channels.size()));
        channel->place = text.substr(equal + 1);
    }
    return {};
}

Result<NewConfiguration> configuration_of(const NewFlags& flags, bool ask) {
    NewConfiguration wanted;
    auto link = link_of(flags);
    if (!link) return std::unexpected(link.error());
    wanted.link = std::move(*link);
    if (const std::string complaint = check_link_options(wanted.link); !complaint.empty())
        return refuse(complaint);
    wanted.machine = flags.machine;
    if (!flags.database.empty()) wanted.database = flags.database;
    if (!flags.socket.empty()) wanted.socket = flags.socket;
    const auto inputs = flags.probe ? look_at_the_module(flags, wanted) : units_as_told(flags, wanted);
    if (!inputs) return std::unexpected(inputs.error());
    wanted.channels = channels_of_inputs(*inputs, flags.channels, flags.ambient);
    const bool room_is_measured = !flags.ambient.empty() && flags.ambient != "none";
    if (room_is_measured && std::ranges::none_of(wanted.channels, &NewConfiguration::Channel::ambient)) {
        return refuse(fmt::format("--ambient: no channel is named \"{}\"; accepted: T1 to T{}, or none",
                                  flags.ambient, wanted.channels.size()));
    }
    if (ask) {
        if (auto asked = ask_for_channels(wanted, flags); !asked) return std::unexpected(asked.error());
    }
    if (auto set = set_places(wanted, flags.places); !set) return std::unexpected(set.error());
    return wanted;
}

Result<void> refuse_to_replace(const NewFlags& flags) {
    std::error_code error;
    if (flags.out == "-" || flags.force || !std::filesystem::exists(flags.out, error)) return {};
    return refuse(fmt::format("{}: is there already; --force replaces it, --out names another", flags.out));
}

Result<void> write_configuration(const NewFlags& flags, const std::string& text) {
    // What the daemon would refuse is not written.
    if (auto sound = load_config(text, flags.out, profiles_in(profile_folders(flags.profiles))); !sound)
        return std::unexpected(sound.error());
    if (auto free = refuse_to_replace(flags); !free) return free;
    return write_file(flags.out, text);
}

int run_new(NewFlags flags) {
    // Before the questions, not after them.
    if (const auto free = refuse_to_replace(flags); !free) return report_error(free.error());
    const bool ask = !flags.no_questions && Questions::somebody_is_there();
    if (ask) {
        if (const auto asked = ask_for_the_rest(flags); !asked) return report_error(asked.error());
    }
    const auto wanted = configuration_of(flags, ask);
    if (!wanted) return report_error(wanted.error());
    if (const auto written = write_configuration(flags, configuration_text(*wanted)); !written)
        return report_error(written.error());
    if (flags.out != "-")
        fmt::print(stderr, "{}: {} channels; `thermbald --check-config {}` explains it\n", flags.out,
                   wanted->channels.size(), flags.out);
    return 0;
}

}  // namespace

void add_new_command(CLI::App& app, int& status) {
    CLI::App& command = *app.add_subcommand(
        "new", "write a commented configuration: asks at a terminal for what the flags do not say");
    command.group("Set up");
    const auto flags = std::make_shared<NewFlags>();
    command.add_option("--out", flags->out, "file to write, or - for standard output")->capture_default_str();
    auto* tcp =
        command.add_option("--tcp", flags->tcp, "the module's address on Modbus TCP: HOST or HOST:PORT");
    auto* gateway =
        command
            .add_option("--rtu-over-tcp", flags->rtu_over_tcp, "a gateway that passes RTU frames: HOST:PORT")
            ->excludes(tcp);
    command.add_option("--rtu", flags->rtu, "the serial port; see thermbalctl ports")
        ->excludes(tcp)
        ->excludes(gateway);
    command.add_option("--baud", flags->baud, "its speed; with --probe only this one is tried")
        ->check(CLI::IsMember(known_baud_rates()));
    command.add_option("--parity", flags->parity, "its parity: N, E or O")
        ->check(CLI::IsMember({"N", "E", "O"}));
    command.add_option("--unit", flags->unit_ids, "unit id of a module; may be given several times")
        ->check(CLI::Range(0, 255));
    command.add_option("--profile", flags->profile, "the module's profile: a name, or a path");
    command.add_flag("--probe", flags->probe, "look at the module, read only, for its settings and profile");
    command.add_option("--channels", flags->channels, "at most so many channels")
        ->capture_default_str()
        ->check(CLI::Range(std::size_t{1}, most_channels));
    command.add_option("--ambient", flags->ambient, "the channel that measures the room, or none")
        ->capture_default_str();
    command.add_option("--place", flags->places, "T2=\"front bearing\"; may be given several times");
    command.add_option("--machine", flags->machine, "name of the machine");
    command.add_option("--database", flags->database, "full path of the database");
    command.add_option("--socket", flags->socket, "full path of the daemon's socket");
    command.add_option("--profiles", flags->profiles, "a further folder with module profiles");
    command.add_flag("--force", flags->force, "replace the file when it is there");
    command.add_flag("--no-questions", flags->no_questions, "ask nothing, also at a terminal");
    command.callback([&status, flags] { status = run_new(*flags); });
}

}  // namespace thermbal
