#include <algorithm>
#include <cmath>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "config/load.hpp"
#include "mqtt.hpp"
#include "toml_reader.hpp"

namespace thermbal {
namespace {

std::string explain_inputs(const std::vector<KnownInput>& inputs) {
    if (inputs.empty()) return "";
    std::vector<std::string> values;
    values.reserve(inputs.size());
    for (const KnownInput& input : inputs) values.push_back(fmt::format("{} = {}", input.name, input.value));
    return fmt::format("inputs = {{ {} }}\n", fmt::join(values, ", "));
}

std::string explain_test(const TestConfig& test) {
    const std::string limit = test.max_duration_min
                                  ? fmt::format("max_duration_min = {}\n", *test.max_duration_min)
                                  : std::string();
    return fmt::format(
        "[test]\nname = {}\nmachine = {}\nperiod_s = {}\n{}keep_measuring = {}\nstart = \"{}\"\n{}{}",
        toml_quoted(test.name), toml_quoted(test.machine), test.period_s, limit, test.keep_measuring,
        test.start == TestConfig::Start::manual ? "manual" : "auto",
        test.model.empty() ? "" : fmt::format("model = {}\n", toml_quoted(test.model)),
        explain_inputs(test.inputs));
}

/// 1.001 s is 1001 ms, not the 1000.9999999999999 of binary fractions.
double milliseconds(double s) {
    return std::round(s * 1e9) / 1e6;
}

std::string explain_serial(const LineConfig& line) {
    std::string text;
    if (line.usb) {
        const PortSelector& usb = *line.usb;
        std::vector<std::string> parts;
        if (usb.usb_vid && usb.usb_pid) {
            parts.push_back(fmt::format("vid_pid = \"{:04x}:{:04x}\"", *usb.usb_vid, *usb.usb_pid));
        }
        if (!usb.serial.empty()) parts.push_back("serial = " + toml_quoted(usb.serial));
        text += fmt::format("usb = {{ {} }}\n", fmt::join(parts, ", "));
    } else {
        text += fmt::format("device = {}\n", toml_quoted(line.link.device));
    }
    return text + fmt::format("baud = {}\nparity = \"{}\"\ndata_bits = {}\nstop_bits = {}\n", line.link.baud,
                              parity_name(line.link.parity), line.link.data_bits, line.link.stop_bits);
}

std::string explain_line(const LineConfig& line) {
    const LinkOptions& link = line.link;
    std::string text = fmt::format("\n[[line]]\nname = {}\ntransport = \"{}\"\n", toml_quoted(link.name),
                                   transport_name(link.transport));
    if (link.transport == Transport::rtu) {
        text += explain_serial(line);
    } else {
        text += fmt::format("host = {}\nport = {}\nconnect_timeout_ms = {}\n", toml_quoted(link.host),
                            link.port, milliseconds(link.connect_timeout_s));
    }
    return text +
           fmt::format(
               "response_timeout_ms = {}\nquiet_ms = {}\nconfirm_reads = {}\nreconnect_pause_ms = {}\n",
               milliseconds(link.response_timeout_s), milliseconds(link.quiet_s), link.confirm_reads,
               milliseconds(link.longest_pause_s));
}

std::string as_comment(const std::string& text) {
    std::string comment = "# ";
    for (const char c : text) comment += c == '\n' ? std::string("\n# ") : std::string(1, c);
    comment.resize(comment.size() - 2);
    return comment;
}

std::string explain_unit(const Config& config, const UnitConfig& unit) {
    return fmt::format(
        "\n[[unit]]\nname = {}\nline = {}\nunit_id = {}\nprofile = {}\nfrozen_after_min = {}\n{}",
        toml_quoted(unit.name), toml_quoted(config.lines[unit.line].link.name), unit.unit_id,
        toml_quoted(unit.profile_name), unit.frozen_after_min, as_comment(explain_profile(unit.profile)));
}

std::string explain_calibration(const Calibration& calibration) {
    if (!calibration.certificate) return fmt::format("offset_C = {}\n", calibration.offset_C);
    const PlatinumCoefficients& sensor = *calibration.certificate;
    return fmt::format("certificate = {{ number = {}, R0_ohm = {}, A = {}, B = {}, C = {} }}\n",
                       toml_quoted(calibration.certificate_number), sensor.R0_ohm, sensor.A, sensor.B,
                       sensor.C);
}

std::string explain_channel(const Config& config, const ChannelConfig& channel) {
    return fmt::format(
        "\n[[channel]]\nname = {}\nunit = {}\ninput = {}\nrole = \"{}\"\nplace = {}\nrequired = {}\n{}",
        toml_quoted(channel.name), toml_quoted(config.units[channel.unit].name), channel.input,
        channel.role == ChannelConfig::Role::ambient ? "ambient" : "structure", toml_quoted(channel.place),
        channel.required, explain_calibration(channel.calibration));
}

std::string explain_alarm(const Config& config, const AlarmConfig& alarm) {
    std::string text = fmt::format("\n[[alarm]]\nname = {}\n", toml_quoted(alarm.name));
    if (alarm.channel)
        text += fmt::format("channel = {}\n", toml_quoted(config.channels[*alarm.channel].name));
    if (alarm.above_C) text += fmt::format("above_C = {}\n", *alarm.above_C);
    if (alarm.below_C) text += fmt::format("below_C = {}\n", *alarm.below_C);
    if (alarm.rate_C_per_min) {
        text += fmt::format("rate_C_per_min = {}\nrate_over_min = {}\n", *alarm.rate_C_per_min,
                            alarm.rate_over_min);
    }
    return text + fmt::format("scans = {}\n", alarm.scans);
}

std::string explain_stop(const Config& config) {
    const StopConfig& stop = config.stop;
    std::string text = "\n[stop]\n";
    switch (stop.action) {
        case StopConfig::Action::none:
            text += "action = \"none\"\n";
            break;
        case StopConfig::Action::command: {
            std::vector<std::string> words(stop.command.size());
            std::ranges::transform(stop.command, words.begin(), toml_quoted);
            text += fmt::format("action = \"command\"\ncommand = [{}]\n", fmt::join(words, ", "));
            break;
        }
        case StopConfig::Action::write_coil:
        case StopConfig::Action::write_register:
            text += fmt::format(
                "action = \"{}\"\nline = {}\nunit_id = {}\naddress = {}\nvalue = {}\n",
                stop.action == StopConfig::Action::write_coil ? "write_coil" : "write_register",
                toml_quoted(config.lines[stop.line].link.name), stop.unit_id, stop.address, stop.value);
            break;
    }
    return text + fmt::format("timeout_s = {}\n", stop.timeout_s);
}

}  // namespace

std::string explain_config(const Config& config) {
    const IdentificationConfig& identification = config.identification;
    std::string text = explain_test(config.test);
    text += fmt::format("\n[store]\npath = {}\n", toml_quoted(config.store.path));
    text += fmt::format("\n[service]\nsocket = {}\noperators_group = {}\n",
                        toml_quoted(config.service.socket), toml_quoted(config.service.operators_group));
    text += fmt::format("\n[log]\nlevel = {}\n", toml_quoted(config.log.level));
    text += fmt::format(
        "\n[identification]\ntolerance_C = {}\nmax_lag = {}\nevery_s = {}\nsweep_always = {}\nworkers = {}\n",
        identification.tolerance_C, identification.max_lag, identification.every_s,
        identification.sweep_always, identification.workers);
    text += explain_stop(config);
    if (config.mqtt) text += explain_mqtt(*config.mqtt);
    for (const LineConfig& line : config.lines) text += explain_line(line);
    for (const UnitConfig& unit : config.units) text += explain_unit(config, unit);
    for (const ChannelConfig& channel : config.channels) text += explain_channel(config, channel);
    for (const AlarmConfig& alarm : config.alarms) text += explain_alarm(config, alarm);
    return text;
}

}  // namespace thermbal
