#include "new_configuration.hpp"

#include <fmt/format.h>

#include "config/quoted.hpp"

namespace thermbal {
namespace {

std::string line_text(const LinkOptions& link) {
    std::string text = fmt::format(
        "[[line]]                     # one Modbus connection\nname = \"line\"\ntransport = \"{}\"\n",
        transport_name(link.transport));
    if (link.transport == Transport::rtu) {
        text += fmt::format(
            "device = {}    # a path of /dev/serial/by-id stays after replugging\nbaud = {}\nparity = "
            "\"{}\"\n",
            toml_quoted(link.device), link.baud, parity_name(link.parity));
    } else {
        text += fmt::format("host = {}\nport = {}\n", toml_quoted(link.host), link.port);
    }
    return text + fmt::format("response_timeout_ms = {}\n", link.response_timeout_s * 1000.0);
}

std::string unit_text(const NewConfiguration::Unit& unit) {
    return fmt::format(
        "\n[[unit]]                     # one module\nname = \"unit {}\"\nline = \"line\"\nunit_id = "
        "{}\nprofile = "
        "{}    # its register map\n",
        unit.unit_id, unit.unit_id, toml_quoted(unit.profile));
}

std::string channel_text(const NewConfiguration& wanted, const NewConfiguration::Channel& channel) {
    const std::string role =
        channel.ambient ? "role = \"ambient\"             # the room: the reference, never required\n" : "";
    return fmt::format("\n[[channel]]\nname = \"{}\"\nunit = \"unit {}\"\ninput = {}\n{}place = {}\n",
                       channel.name, wanted.units[channel.unit].unit_id, channel.input, role,
                       toml_quoted(channel.place));
}

}  // namespace

std::vector<NewConfiguration::Channel> channels_of_inputs(const std::vector<int>& inputs, std::size_t most,
                                                          const std::string& ambient) {
    std::vector<NewConfiguration::Channel> channels;
    for (std::size_t unit = 0; unit < inputs.size(); ++unit) {
        for (int input = 1; input <= inputs[unit] && channels.size() < most; ++input) {
            std::string name = fmt::format("T{}", channels.size() + 1);
            const bool is_ambient = name == ambient;
            channels.push_back(
                {std::move(name), unit, input, is_ambient, is_ambient ? "air at the machine" : ""});
        }
    }
    return channels;
}

std::string modules_text(const NewConfiguration& wanted) {
    std::string text = line_text(wanted.link);
    for (const NewConfiguration::Unit& unit : wanted.units) text += unit_text(unit);
    text +=
        "\n# One [[channel]] a sensor; input as printed on the module. required = false: the end does not "
        "wait for it.\n";
    for (const NewConfiguration::Channel& channel : wanted.channels) text += channel_text(wanted, channel);
    return text;
}

std::string configuration_text(const NewConfiguration& wanted) {
    std::string text = fmt::format(
        "# Made by thermbalctl new. `thermbald --check-config FILE` says what is wrong with it, or what is "
        "in effect.\n"
        "# Every other key with its default: thermbald.toml(5).\n\n"
        "[test]\nname = {}\nmachine = {}    # earlier tests of the same machine are used\n"
        "period_s = 15.0              # one scan of all channels\n"
        "keep_measuring = false       # true: go on after the declaration, so that it can be checked\n"
        "start = \"{}\"             # \"manual\": thermbalctl start\n\n",
        toml_quoted(wanted.test_name), toml_quoted(wanted.machine),
        wanted.start_automatically ? "auto" : "manual");
    text +=
        fmt::format("[store]\npath = {}\n\n[service]\nsocket = {}\n\n[log]\nlevel = {}\n\n",
                    toml_quoted(wanted.database), toml_quoted(wanted.socket), toml_quoted(wanted.log_level));
    text += fmt::format(
        "[identification]\ntolerance_C = 0.2            # a channel is declared when its steady state is "
        "known "
        "this well\nsweep_always = {}\n\n",
        wanted.sweep_always);
    text +=
        "[stop]                       # what happens on the machine at the end\n" + wanted.stop_toml + "\n";
    return text + modules_text(wanted);
}

}  // namespace thermbal
