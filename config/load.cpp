#include "config/load.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "checks.hpp"
#include "mqtt.hpp"
#include "series/recorded_test.hpp"
#include "toml_reader.hpp"

namespace thermbal {
namespace {

/// Names of tables and where they are in their vector.
using Index = std::map<std::string, std::size_t, std::less<>>;

std::string names_of(const Index& index) {
    std::string names;
    for (const auto& [name, position] : index) names += (names.empty() ? "\"" : ", \"") + name + '"';
    return names.empty() ? "there is none" : names;
}

IdentificationConfig identification_in(TableReader& reader) {
    IdentificationConfig identification;
    set(identification.tolerance_C, reader.number("tolerance_C", {0.01, 5.0}));
    set(identification.max_lag, reader.integer("max_lag", {1, 100}));
    set(identification.every_s, reader.number("every_s", {0.1, 3600.0}));
    set(identification.sweep_always, reader.boolean("sweep_always"));
    set(identification.workers, reader.integer("workers", {1, 64}));
    return identification;
}

class Loader {
  public:
    Loader(const toml::table& root, const ProfileLookup& lookup, Complaints& complaints)
        : root_(root), lookup_(lookup), complaints_(complaints) {
        tables_.root = &root;
    }

    Config load() {
        TableReader reader(root_, "", complaints_);
        section(reader, "test", &Loader::read_test);
        section(reader, "store", &Loader::read_store);
        section(reader, "service", &Loader::read_service);
        section(reader, "log", &Loader::read_log);
        reader.require("line", "one [[line]] a Modbus connection");
        reader.require("unit", "one [[unit]] a module");
        reader.require("channel", "one [[channel]] a sensor");
        for (const toml::table* table : reader.tables("line")) read_line(*table);
        for (const toml::table* table : reader.tables("unit")) read_unit(*table);
        for (const toml::table* table : reader.tables("channel")) read_channel(*table);
        for (const toml::table* table : reader.tables("alarm")) read_alarm(*table);
        section(reader, "identification", &Loader::read_identification);
        section(reader, "stop", &Loader::read_stop);
        section(reader, "mqtt", &Loader::read_mqtt_section);
        reader.finish();
        // Defaults stand where something was refused: what they would say about each other would be about
        // nothing.
        if (complaints_.empty()) check_config(config_, tables_, complaints_);
        return std::move(config_);
    }

  private:
    void section(TableReader& reader, std::string_view key, void (Loader::*read)(TableReader&)) {
        const toml::table* table = reader.table(key);
        if (table == nullptr) return;
        TableReader section_reader(*table, std::string(key), complaints_);
        (this->*read)(section_reader);
        section_reader.finish();
    }

    void read_test(TableReader& reader) {
        TestConfig& test = config_.test;
        set(test.name, reader.text("name"));
        set(test.machine, reader.text("machine"));
        set(test.period_s, reader.number("period_s", {0.1, 3600.0}));
        test.max_duration_min = reader.number("max_duration_min", {1.0, 100'000.0});
        set(test.keep_measuring, reader.boolean("keep_measuring"));
        if (const auto start = reader.choice("start", {"manual", "auto"})) {
            test.start = *start == 0 ? TestConfig::Start::manual : TestConfig::Start::automatic;
        }
        read_path(reader, "model", test.model);
        if (const toml::table* inputs = reader.table("inputs")) read_inputs(*inputs, test);
    }

    void read_inputs(const toml::table& table, TestConfig& test) {
        TableReader reader(table, "test.inputs", complaints_);
        for (const auto& [key, value] : table) {
            if (!is_input_name(key.str()))
                reader.complain(key.str(), "accepted: a name of letters, digits and _ that is no channel's");
            if (const auto number = reader.number(key.str(), {-1e12, 1e12}))
                test.inputs.push_back({std::string(key.str()), *number});
        }
        reader.finish();
    }

    void read_path(TableReader& reader, std::string_view key, std::string& path) {
        const auto found = reader.text(key);
        if (!found) return;
        if (found->starts_with('/'))
            path = *found;
        else
            reader.complain(key, fmt::format("found \"{}\"; accepted: a path that begins with /", *found));
    }

    void read_store(TableReader& reader) { read_path(reader, "path", config_.store.path); }

    void read_service(TableReader& reader) {
        read_path(reader, "socket", config_.service.socket);
        // sun_path of sockaddr_un, with its closing zero.
        if (config_.service.socket.size() > 107) reader.complain("socket", "accepted: at most 107 bytes");
        set(config_.service.operators_group, reader.text("operators_group"));
    }

    void read_log(TableReader& reader) {
        static constexpr std::string_view levels[] = {"trace", "debug", "info", "warning", "error"};
        if (const auto level = reader.choice("level", {"trace", "debug", "info", "warning", "error"})) {
            config_.log.level = levels[*level];
        }
    }

    void read_identification(TableReader& reader) { config_.identification = identification_in(reader); }

    std::string read_name(TableReader& reader, std::string_view fallback) {
        const auto name = reader.text("name");
        if (!name) return std::string(fallback);
        if (name->empty()) reader.complain("name", "is empty; accepted: a name");
        return *name;
    }

    void read_line(const toml::table& table) {
        TableReader reader(table, "line", complaints_);
        LineConfig line;
        line.link.name = read_name(reader, fmt::format("line {}", config_.lines.size() + 1));
        reader.require("transport", "\"tcp\", \"rtu\" or \"rtu_over_tcp\"");
        constexpr Transport transports[] = {Transport::tcp, Transport::rtu, Transport::rtu_over_tcp};
        if (const auto transport = reader.choice("transport", {"tcp", "rtu", "rtu_over_tcp"})) {
            line.link.transport = transports[*transport];
            if (line.link.transport == Transport::rtu)
                read_serial(reader, line);
            else
                read_network(reader, line);
            read_timeouts(reader, line.link);
            reader.finish();
        }
        lines_.emplace(line.link.name, config_.lines.size());
        config_.lines.push_back(std::move(line));
        tables_.lines.push_back(&table);
    }

    void read_network(TableReader& reader, LineConfig& line) {
        reader.require("host", "a name or an IPv4 or IPv6 address");
        if (const auto host = reader.text("host")) {
            line.link.host = *host;
            LinkOptions probe;
            probe.host = *host;
            const std::string complaint = check_link_options(probe);
            if (!complaint.empty()) reader.complain("host", complaint);
        }
        set(line.link.port, reader.integer("port", {1, 65535}));
        if (const auto ms = reader.number("connect_timeout_ms", {1.0, 60'000.0})) {
            line.link.connect_timeout_s = *ms / 1000.0;
        }
    }

    void read_serial(TableReader& reader, LineConfig& line) {
        read_path(reader, "device", line.link.device);
        if (const toml::table* usb = reader.table("usb")) read_usb(*usb, line);
        if (reader.has("device") == reader.has("usb")) {
            reader.complain("device", "accepted: either device = \"/dev/...\", or usb = { vid_pid, serial }");
        }
        if (const auto baud = reader.integer("baud", {1, 10'000'000})) {
            LinkOptions probe;
            probe.transport = Transport::rtu;
            probe.device = "any";
            probe.baud = *baud;
            const std::string complaint = check_link_options(probe);
            if (complaint.empty())
                line.link.baud = *baud;
            else
                reader.complain("baud", complaint);
        }
        constexpr char parities[] = {'N', 'E', 'O'};
        if (const auto parity = reader.choice("parity", {"none", "even", "odd"}))
            line.link.parity = parities[*parity];
        set(line.link.data_bits, reader.integer("data_bits", {8, 8}));
        set(line.link.stop_bits, reader.integer("stop_bits", {1, 2}));
    }

    void read_usb(const toml::table& table, LineConfig& line) {
        TableReader reader(table, "line.usb", complaints_);
        PortSelector selector;
        if (const auto vid_pid = reader.text("vid_pid")) {
            const auto parsed = parse_vid_pid(*vid_pid);
            if (parsed)
                selector = *parsed;
            else
                reader.complain("vid_pid", parsed.error().message);
        }
        set(selector.serial, reader.text("serial"));
        reader.finish();
        if (!reader.has("vid_pid") && selector.serial.empty()) {
            reader.complain("vid_pid", "is missing; accepted: vid_pid = \"1a86:7523\", serial, or both");
        }
        line.usb = selector;
    }

    void read_timeouts(TableReader& reader, LinkOptions& link) {
        if (const auto ms = reader.number("response_timeout_ms", {1.0, 60'000.0}))
            link.response_timeout_s = *ms / 1000.0;
        if (const auto ms = reader.number("quiet_ms", {0.0, 1000.0})) link.quiet_s = *ms / 1000.0;
        set(link.confirm_reads, reader.boolean("confirm_reads"));
        read_pause(reader, link);
    }

    /// The first scan after a fault has to find the line awake: a pause is over long before the next scan.
    void read_pause(TableReader& reader, LinkOptions& link) {
        const double period_ms = config_.test.period_s * 1000.0;
        const double usual_ms = std::min(link.longest_pause_s * 1000.0, std::floor(period_ms / 4.0));
        const auto ms = reader.number("reconnect_pause_ms", {0.0, period_ms});
        link.longest_pause_s = ms.value_or(usual_ms) / 1000.0;
        link.first_pause_s = std::min(link.first_pause_s, link.longest_pause_s);
    }

    /// Which of `index` the key names; the only one there is when the key is not given.
    std::size_t reference(TableReader& reader, std::string_view key, const Index& index) {
        const auto name = reader.text(key);
        if (name) {
            if (const auto found = index.find(*name); found != index.end()) return found->second;
            reader.complain(key, fmt::format("found \"{}\"; accepted: {}", *name, names_of(index)));
        } else if (!reader.has(key) && index.size() != 1) {
            reader.complain(key, fmt::format("is missing; accepted: {}", names_of(index)));
        }
        return 0;
    }

    void read_unit(const toml::table& table) {
        TableReader reader(table, "unit", complaints_);
        UnitConfig unit;
        unit.name = read_name(reader, fmt::format("unit {}", config_.units.size() + 1));
        unit.line = reference(reader, "line", lines_);
        const bool serial =
            unit.line < config_.lines.size() && config_.lines[unit.line].link.transport != Transport::tcp;
        set(unit.unit_id, reader.integer("unit_id", serial ? Range{1, 247} : Range{0, 255}));
        reader.require("profile", "the name or the path of a module profile");
        if (const auto name = reader.text("profile")) {
            unit.profile_name = *name;
            auto profile = lookup_(*name);
            if (profile)
                unit.profile = std::move(*profile);
            else
                reader.complain("profile", profile.error().message);
        }
        set(unit.frozen_after_min, reader.number("frozen_after_min", {1.0, 1440.0}));
        reader.finish();
        units_.emplace(unit.name, config_.units.size());
        config_.units.push_back(std::move(unit));
        tables_.units.push_back(&table);
    }

    void read_channel(const toml::table& table) {
        TableReader reader(table, "channel", complaints_);
        ChannelConfig channel;
        reader.require("name", "T1, T2, ...");
        set(channel.name, reader.text("name"));
        if (reader.has("name") && !is_channel_name(channel.name)) {
            reader.complain("name",
                            fmt::format("found \"{}\"; accepted: T and a number, such as T1", channel.name));
        }
        channel.unit = reference(reader, "unit", units_);
        reader.require("input", "the number of the input on the module, from 1 on");
        set(channel.input, reader.integer("input", {1, 256}));
        if (const auto role = reader.choice("role", {"structure", "ambient"})) {
            channel.role = *role == 0 ? ChannelConfig::Role::structure : ChannelConfig::Role::ambient;
        }
        const bool ambient = channel.role == ChannelConfig::Role::ambient;
        channel.required = !ambient;
        set(channel.required, reader.boolean("required"));
        if (ambient && channel.required) {
            reader.complain("required",
                            "found true; accepted: false: the ambient does not settle, it is the reference");
        }
        set(channel.place, reader.text("place"));
        set(channel.calibration.offset_C, reader.number("offset_C", {-20.0, 20.0}));
        if (const toml::table* certificate = reader.table("certificate")) {
            if (reader.has("offset_C")) {
                reader.complain("certificate", "accepted: either offset_C or certificate, not both");
            }
            read_certificate(*certificate, channel.calibration);
        }
        reader.finish();
        channels_.emplace(channel.name, config_.channels.size());
        config_.channels.push_back(std::move(channel));
        tables_.channels.push_back(&table);
    }

    void read_certificate(const toml::table& table, Calibration& calibration) {
        TableReader reader(table, "channel.certificate", complaints_);
        PlatinumCoefficients sensor;
        reader.require("R0_ohm", "the resistance at 0 C, as the certificate says it");
        set(calibration.certificate_number, reader.text("number"));
        set(sensor.R0_ohm, reader.number("R0_ohm", {1.0, 10'000.0}));
        set(sensor.A, reader.number("A", {-1.0, 1.0}));
        set(sensor.B, reader.number("B", {-1.0, 1.0}));
        set(sensor.C, reader.number("C", {-1.0, 1.0}));
        if (const std::string complaint = check_coefficients(sensor); !complaint.empty()) {
            reader.complain("", complaint);
        }
        reader.finish();
        calibration.certificate = sensor;
    }

    void read_alarm(const toml::table& table) {
        TableReader reader(table, "alarm", complaints_);
        AlarmConfig alarm;
        alarm.name = read_name(reader, fmt::format("alarm {}", config_.alarms.size() + 1));
        if (reader.has("channel")) alarm.channel = reference(reader, "channel", channels_);
        alarm.above_C = reader.number("above_C", {-200.0, 850.0});
        alarm.below_C = reader.number("below_C", {-200.0, 850.0});
        alarm.rate_C_per_min = reader.number("rate_C_per_min", {0.001, 1000.0});
        set(alarm.rate_over_min, reader.number("rate_over_min", {0.1, 60.0}));
        set(alarm.scans, reader.integer("scans", {1, 100}));
        reader.finish();
        if (!reader.has("above_C") && !reader.has("below_C") && !reader.has("rate_C_per_min")) {
            reader.complain("above_C",
                            "is missing; accepted: above_C, below_C or rate_C_per_min, or several");
        }
        if (alarm.above_C && alarm.below_C && *alarm.above_C <= *alarm.below_C) {
            reader.complain("above_C",
                            fmt::format("found {}, which is not above below_C = {}: every reading would "
                                        "be an alarm",
                                        *alarm.above_C, *alarm.below_C));
        }
        config_.alarms.push_back(std::move(alarm));
        tables_.alarms.push_back(&table);
    }

    static bool is_channel_name(std::string_view name) {
        return name.size() >= 2 && name.size() <= 5 && name[0] == 'T' && name[1] != '0' &&
               std::ranges::all_of(name.substr(1), [](char c) { return c >= '0' && c <= '9'; });
    }

    void read_stop(TableReader& reader) {
        using Action = StopConfig::Action;
        StopConfig& stop = config_.stop;
        constexpr Action actions[] = {Action::none, Action::command, Action::write_coil,
                                      Action::write_register};
        if (const auto action =
                reader.choice("action", {"none", "command", "write_coil", "write_register"})) {
            stop.action = actions[*action];
        }
        set(stop.timeout_s, reader.number("timeout_s", {0.1, 600.0}));
        if (stop.action == Action::command)
            read_stop_command(reader);
        else if (stop.action != Action::none)
            read_stop_write(reader);
    }

    void read_stop_command(TableReader& reader) {
        reader.require("command", "a list: the program and its arguments");
        set(config_.stop.command, reader.texts("command"));
        if (!reader.has("command")) return;
        if (config_.stop.command.empty() || !config_.stop.command[0].starts_with('/')) {
            reader.complain(
                "command", "accepted: a list that begins with the full path of a program; there is no shell");
        }
    }

    void read_stop_write(TableReader& reader) {
        const bool coil = config_.stop.action == StopConfig::Action::write_coil;
        config_.stop.line = reference(reader, "line", lines_);
        reader.require("address", "the address of the coil or register, from 0 on");
        set(config_.stop.unit_id, reader.integer("unit_id", {1, 247}));
        set(config_.stop.address, reader.integer("address", {0, 65535}));
        set(config_.stop.value, reader.integer("value", coil ? Range{0, 1} : Range{0, 65535}));
    }

    void read_mqtt_section(TableReader& reader) { config_.mqtt = read_mqtt(reader); }

    const toml::table& root_;
    const ProfileLookup& lookup_;
    Complaints& complaints_;
    Config config_;
    ConfigTables tables_;
    Index lines_;
    Index units_;
    Index channels_;
};

}  // namespace

std::optional<std::size_t> Config::ambient() const {
    for (std::size_t i = 0; i < channels.size(); ++i) {
        if (channels[i].role == ChannelConfig::Role::ambient) return i;
    }
    return std::nullopt;
}

Result<Config> load_config(std::string_view toml, std::string_view file_name, const ProfileLookup& lookup) {
    Complaints complaints(file_name);
    const auto root = parse_toml(toml, complaints);
    if (!root) return std::unexpected(complaints.error());
    Config config = Loader(*root, lookup, complaints).load();
    if (!complaints.empty()) return std::unexpected(complaints.error());
    return config;
}

IdentificationConfig stored_identification(std::string_view toml) {
    Complaints complaints("");
    const auto root = parse_toml(toml, complaints);
    if (!root) return {};
    TableReader reader(*root, "", complaints);
    const toml::table* const table = reader.table("identification");
    if (table == nullptr) return {};
    TableReader identification(*table, "identification", complaints);
    return identification_in(identification);
}

}  // namespace thermbal
