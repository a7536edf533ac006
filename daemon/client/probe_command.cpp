#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>

#include <fmt/format.h>

#include "commands.hpp"
#include "config/load.hpp"
#include "files.hpp"
#include "manual/flags.hpp"
#include "network_address.hpp"
#include "output.hpp"
#include "probe/report.hpp"
#include "profile_files.hpp"
#include "progress.hpp"

namespace thermbal {
namespace {

struct ProbeFlags {
    std::string where;
    int port = LinkOptions{}.port;
    bool rtu_over_tcp = false;
    std::vector<int> bauds = {9600, 19200, 38400, 57600, 115200, 4800};
    std::string parities = "NE";
    std::string units = "1-8";
    int last_register = 127;
    double timeout_ms = 200.0;
    double limit_s = 60.0;
    std::vector<std::string> profiles;
    std::string profile_out;
    std::string config_out;
    bool json = false;
};

Result<void> read_units(const std::string& text, ProbeOptions& options) {
    int first = 0;
    int last = 0;
    char more = 0;
    const int fields = std::sscanf(text.c_str(), "%d-%d%c", &first, &last, &more);
    if (fields == 1 && text.find('-') == std::string::npos) last = first;
    const bool sound =
        (fields == 2 || (fields == 1 && last == first)) && first >= 0 && last >= first && last <= 255;
    if (!sound) {
        return fail(
            NextStep::refuse_input,
            fmt::format("--units: found \"{}\"; accepted: a number or a range such as 1-8, in 0 to 255",
                        text));
    }
    options.first_unit = first;
    options.last_unit = last;
    return {};
}

Result<void> write_out(const ProbeFlags& flags, const ProbeResult& result) {
    if (flags.profile_out.empty() && flags.config_out.empty()) return {};
    const auto start = starting_point(result);
    if (!start) return std::unexpected(start.error());
    if (!flags.config_out.empty()) {
        if (auto written = write_file(flags.config_out, start->config_toml); !written) return written;
    }
    if (flags.profile_out.empty() || start->profile_toml.empty()) return {};
    return write_file(flags.profile_out, start->profile_toml);
}

std::string starting_text(const ProbeResult& result) {
    const auto start = starting_point(result);
    if (!start) return "\n" + start.error().message + "\n";
    const std::string profile =
        start->profile_toml.empty()
            ? std::string()
            : fmt::format("\n--- profiles/{}.toml\n{}", start->profile_name, start->profile_toml);
    return profile + "\n--- thermbald.toml\n" + start->config_toml;
}

int run_probe(const ProbeFlags& flags, LinkOptions link) {
    ProbeOptions options;
    if (auto units = read_units(flags.units, options); !units) return report_error(units.error());
    link.name = "probe";
    link.response_timeout_s = flags.timeout_ms / 1000.0;
    link.connect_timeout_s = std::max(1.0, link.response_timeout_s);
    options.link = std::move(link);
    options.bauds = flags.bauds;
    options.parities = flags.parities;
    options.last_register = flags.last_register;
    options.limit_s = flags.limit_s;
    options.profiles = profiles_there(flags.profiles);
    if (const std::string complaint = check_link_options(options.link); !complaint.empty()) {
        return report_error({NextStep::refuse_input, complaint});
    }
    std::optional<Progress> progress("probe");
    const auto began = std::chrono::steady_clock::now();
    progress->follow([&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count() /
               options.limit_s;
    });
    const ProbeResult result = probe(options);
    progress.reset();
    if (flags.json && print_json(probe_json(result)) != 0) return 1;
    if (result.units.empty()) {
        return report_error(
            {NextStep::stop, result.trouble.empty()
                                 ? std::string("nobody answered: other units, another speed or parity?")
                                 : result.trouble.front()});
    }
    if (auto written = write_out(flags, result); !written) return report_error(written.error());
    return flags.json ? 0 : print_text(probe_text(result) + starting_text(result));
}

void add_common_flags(CLI::App& command, ProbeFlags& flags) {
    command.add_option("--units", flags.units, "unit ids: one, or a range")->capture_default_str();
    command.add_option("--last-register", flags.last_register, "look at the registers from 0 to this one")
        ->capture_default_str()
        ->check(CLI::Range(0, 65535));
    command.add_option("--timeout-ms", flags.timeout_ms, "how long a unit may take for a reply")
        ->capture_default_str()
        ->check(number_in(5.0, 10'000.0));
    command.add_option("--limit-s", flags.limit_s, "how long the probe may take")
        ->capture_default_str()
        ->check(number_in(0.1, 3600.0));
    command.add_option("--profiles", flags.profiles, "a further folder with module profiles");
    command.add_option("--write-profile", flags.profile_out,
                       "write the profile that was found into this file");
    command.add_option("--write-config", flags.config_out,
                       "write a configuration to start from into this file");
    command.add_flag("--json", flags.json, "one JSON document on standard output");
}

void add_tcp(CLI::App& probe_app, int& status) {
    CLI::App& command = *probe_app.add_subcommand("tcp", "a module or gateway on Modbus TCP");
    const auto flags = std::make_shared<ProbeFlags>();
    command.add_option("HOST", flags->where, "name or address, or HOST:PORT")->required();
    command.add_option("--port", flags->port, "TCP port, where HOST has none")
        ->capture_default_str()
        ->check(CLI::Range(1, 65535));
    command.add_flag("--rtu-over-tcp", flags->rtu_over_tcp, "the gateway passes RTU frames through");
    add_common_flags(command, *flags);
    command.callback([&status, flags] {
        auto link = network_link(flags->where, flags->rtu_over_tcp ? Transport::rtu_over_tcp : Transport::tcp,
                                 flags->port);
        status = link ? run_probe(*flags, std::move(*link)) : report_error(link.error());
    });
}

void add_rtu(CLI::App& probe_app, int& status) {
    CLI::App& command = *probe_app.add_subcommand("rtu", "modules on a serial line");
    const auto flags = std::make_shared<ProbeFlags>();
    command.add_option("DEVICE", flags->where, "path of the port; see thermbalctl ports")->required();
    command.add_option("--baud", flags->bauds, "speeds to try, in this order")
        ->delimiter(',')
        ->capture_default_str()
        ->check(CLI::IsMember(known_baud_rates()));
    command.add_option("--parity", flags->parities, "parities to try: of N, E, O")
        ->capture_default_str()
        ->check([](const std::string& text) {
            return !text.empty() && text.find_first_not_of("NEO") == std::string::npos
                       ? std::string()
                       : "found \"" + text + "\"; accepted: of N, E, O";
        });
    add_common_flags(command, *flags);
    command.callback([&status, flags] {
        LinkOptions link;
        link.transport = Transport::rtu;
        link.device = flags->where;
        status = run_probe(*flags, std::move(link));
    });
}

}  // namespace

void add_probe_command(CLI::App& app, int& status) {
    CLI::App& command = *app.add_subcommand(
        "probe",
        "look what is on a Modbus line, read only, and print a profile and a configuration to start from");
    command.group("On the database, and on this machine");
    command.require_subcommand(1);
    add_tcp(command, status);
    add_rtu(command, status);
}

}  // namespace thermbal
