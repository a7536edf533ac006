#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "modbus/link.hpp"
#include "modbus/profile.hpp"
#include "serial/ports.hpp"
#include "series/calibration.hpp"

namespace thermbal {

/// A known input of a test, constant until somebody says another value: a column of the recorded test.
struct KnownInput {
    std::string name;
    double value = 0.0;
};

/// The configuration of the daemon: plain data with the defaults of config/README.md. Every reference between
/// tables (line of a unit, unit of a channel) is resolved to an index, every profile is loaded.
struct TestConfig {
    enum class Start : std::uint8_t { manual, automatic };
    std::string name = "thermal balance";
    std::string machine;
    double period_s = 15.0;
    std::optional<double> max_duration_min;  ///< abort a test that runs longer
    bool keep_measuring = false;
    Start start = Start::manual;
    std::string model;               ///< file of the simulation that a test is compared with; empty: none
    std::vector<KnownInput> inputs;  ///< as a test begins: spindle_rpm, ...
};

struct StoreConfig {
    std::string path = "/var/lib/thermbal/thermbal.db";
};

struct ServiceConfig {
    std::string socket = "/run/thermbal/thermbald.sock";
    std::string operators_group;  ///< empty: only the daemon's user and root may change anything
};

struct LogConfig {
    std::string level = "info";  ///< trace, debug, info, warning, error
};

struct LineConfig {
    LinkOptions link;                 ///< link.name is the line's name; find_device is left to the daemon
    std::optional<PortSelector> usb;  ///< rtu: instead of link.device
};

struct UnitConfig {
    std::string name;
    std::size_t line = 0;  ///< index into Config::lines
    int unit_id = 1;
    std::string profile_name;  ///< as the configuration names it: a name or a path
    ModuleProfile profile;
    double frozen_after_min = 30.0;  ///< no word of the module has changed for so long: its samples are stuck
};

struct ChannelConfig {
    enum class Role : std::uint8_t { structure, ambient };
    std::string name;
    std::size_t unit = 0;  ///< index into Config::units
    int input = 1;         ///< 1-based, as printed on the module
    Role role = Role::structure;
    std::string place;
    bool required = true;  ///< the test ends only when it is declared; default false for the ambient
    Calibration calibration;
};

/// Limits that abort a test. At least one of the three is set.
struct AlarmConfig {
    std::string name;
    std::optional<std::size_t> channel;  ///< index into Config::channels; empty: every channel
    std::optional<double> above_C;
    std::optional<double> below_C;
    std::optional<double> rate_C_per_min;  ///< rising or falling
    double rate_over_min = 2.0;
    int scans = 2;  ///< good samples in a row that have to be beyond the limit
};

/// Plain numbers; core's own option structs are filled from these by the daemon.
struct IdentificationConfig {
    double tolerance_C = 0.2;
    int max_lag = 35;
    double every_s = 120.0;
    bool sweep_always = true;  ///< false: sweep over n only where nothing else speaks against a declaration
    int workers = 2;
};

struct StopConfig {
    enum class Action : std::uint8_t { none, command, write_coil, write_register };
    Action action = Action::none;
    std::vector<std::string> command;  ///< program and arguments, no shell
    std::size_t line = 0;              ///< index into Config::lines
    int unit_id = 1;
    int address = 0;
    int value = 1;
    double timeout_s = 10.0;
};

/// Where thermbal-mqtt sends what the database holds. A secret is never here, only the name of its file.
struct MqttConfig {
    enum class Backlog : std::uint8_t { newest_test, all };
    std::string host;
    int port = 1883;  ///< 8883 with TLS
    bool tls = false;
    std::string ca_file;           ///< empty with TLS: the authorities that the system trusts
    std::string certificate_file;  ///< of this client, with key_file
    std::string key_file;
    std::string topic_prefix = "thermbal";
    std::string machine;    ///< level of the topics; empty: [test] machine
    std::string client_id;  ///< empty: made of machine and host
    std::string username;
    std::string password_file;
    int keepalive_s = 30;
    double settle_s =
        60.0;  ///< what the broker acknowledged so recently is sent again after a lost connection
    Backlog backlog = Backlog::newest_test;  ///< what a first start sends of a database
};

struct Config {
    TestConfig test;
    StoreConfig store;
    ServiceConfig service;
    LogConfig log;
    std::vector<LineConfig> lines;
    std::vector<UnitConfig> units;
    std::vector<ChannelConfig> channels;
    std::vector<AlarmConfig> alarms;
    IdentificationConfig identification;
    StopConfig stop;
    std::optional<MqttConfig> mqtt;  ///< empty: nothing is sent

    /// Index into channels; empty when no channel has the role ambient.
    std::optional<std::size_t> ambient() const;
};

}  // namespace thermbal
