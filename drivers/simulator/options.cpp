#include "options.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <limits>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "manual/flags.hpp"
#include "manual/manual.hpp"
#include "manual/standard_streams.hpp"
#include "simulator/scenario.hpp"
#include "simulator/spindle_head.hpp"

namespace thermbal {
namespace {

constexpr std::size_t all_channels = 16;

/// The flags as CLI11 fills them.
struct Flags {
    bool truth = false;
    bool plant = false;
    bool json = false;
    bool rtu = false;
    std::string condition = "5000-idle";
    std::optional<double> rpm;
    bool cutting = false;
    Room room;
    double room_cycle_period_min = 20.0;
    NoiseOptions noise;
    std::string replay_path;
    std::string csv_path;
    double duration_min = 400.0;
    int port = 0;
    std::string bind;
    std::string link_path;
    std::string profile = "int16";
    std::string word_order = "abcd";
    std::string units;
    int first_unit = 1;
    std::string foreign_unit = "exception";
    std::vector<std::string> faults;
    std::string scenario_path;
    std::string control_path;
    std::string truth_log_path;
    std::optional<double> lockstep_s;
    double time_scale = 1.0;
    std::optional<std::int64_t> time_epoch_ns;
    double spindle_start_s = 0.0;
};

std::string known_conditions() {
    std::string names;
    for (const Condition& condition : conditions()) names += (names.empty() ? "" : ", ") + condition.name;
    return names;
}

std::string known_profiles() {
    std::string lines;
    for (const RegisterMap& map : register_maps()) {
        lines += fmt::format("  {:14} {}; open {:#x}, short {:#x}\n", map.name, map.description,
                             map.open_code, map.short_code);
    }
    return lines;
}

/// "16", "8,8", "6,6,4": all channels.
std::string fewest_units(std::size_t most_channels) {
    std::string units;
    for (std::size_t left = all_channels; left > 0; left -= std::min(left, most_channels))
        units += fmt::format("{}{}", units.empty() ? "" : ",", std::min(left, most_channels));
    return units;
}

void add_source_flags(CLI::App& app, Flags& flags) {
    app.add_option("--condition", flags.condition, "What the plant does: " + known_conditions())
        ->capture_default_str()
        ->group("Source");
    app.add_option("--rpm", flags.rpm, "Spindle speed instead of the condition's, r/min")
        ->check(number_in(0.0, 20000.0))
        ->group("Source");
    app.add_flag("--cutting", flags.cutting, "Cut, whatever the condition says")->group("Source");
    app.add_option("--room-C", flags.room.mean_C, "The room, C")
        ->check(number_in(-20.0, 60.0))
        ->capture_default_str()
        ->group("Source");
    app.add_option("--room-drift-C-per-h", flags.room.drift_C_per_h, "How fast the room warms, C/h")
        ->check(number_in(-20.0, 20.0))
        ->group("Source");
    app.add_option("--room-cycle-C", flags.room.cycle_amplitude_C, "Amplitude of a sine on the room, C")
        ->check(number_in(0.0, 20.0))
        ->group("Source");
    app.add_option("--room-cycle-period-min", flags.room_cycle_period_min, "Its period, min")
        ->check(number_in(0.1, 10000.0))
        ->capture_default_str()
        ->group("Source");
    app.add_option("--seed", flags.noise.seed, "Seed of the noise")->capture_default_str()->group("Source");
    app.add_option("--noise-C", flags.noise.noise_C, "Standard deviation of the sensors' noise, C")
        ->check(number_in(0.0, 10.0))
        ->capture_default_str()
        ->group("Source");
    app.add_option("--round-C", flags.noise.round_C, "Resolution of the module, C; 0: none")
        ->check(number_in(0.0, 10.0))
        ->capture_default_str()
        ->group("Source");
    app.add_option("--spindle-start-s", flags.spindle_start_s,
                   "Simulated time at which the spindle starts, s")
        ->check(number_in(0.0, 1e9))
        ->group("Source");
    app.add_option("--replay", flags.replay_path, "A recorded test in CSV instead of the plant")
        ->group("Source");
}

void add_line_flags(CLI::App& app, Flags& flags) {
    app.add_option("--port", flags.port, "TCP port on 127.0.0.1 and ::1; 0: a free one")
        ->check(CLI::Range(0, 65535))
        ->capture_default_str()
        ->group("Line");
    app.add_option("--bind", flags.bind, "Accepted for loopback addresses only: 127.0.0.1, ::1, localhost")
        ->group("Line");
    app.add_flag("--rtu", flags.rtu, "Modbus RTU on a pseudo-terminal instead of TCP")->group("Line");
    app.add_option("--link", flags.link_path, "A symbolic link to the pseudo-terminal")->group("Line");
    app.add_option("--profile", flags.profile, "Register map, see below")
        ->capture_default_str()
        ->group("Line");
    app.add_option("--word-order", flags.word_order, "Of 32-bit values: abcd, cdab, badc, dcba")
        ->capture_default_str()
        ->group("Line");
    app.add_option(
           "--units", flags.units,
           "Channels of each unit, e.g. 16 or 8,8 or 4,4,4,4; 16,16: two units on the same sensors; without "
           "it 16 channels in as few units as the profile allows")
        ->group("Line");
    app.add_option("--first-unit", flags.first_unit, "Id of the first unit; the others follow")
        ->check(CLI::Range(1, 247))
        ->capture_default_str()
        ->group("Line");
    app.add_option("--foreign-unit", flags.foreign_unit, "TCP, another unit id: exception (11), or silence")
        ->check(CLI::IsMember({"exception", "silence"}))
        ->capture_default_str()
        ->group("Line");
    app.add_option("--log-truth", flags.truth_log_path,
                   "Append to this CSV what every read of registers was sent")
        ->group("Line");
}

void add_fault_flags(CLI::App& app, Flags& flags) {
    app.add_option("--fault", flags.faults, "KIND[=VALUE][:TARGET]@FROM_S[-TO_S], several times; see below")
        ->group("Faults")
        ->type_size(1)
        ->allow_extra_args(false);
    app.add_option("--scenario", flags.scenario_path, "A TOML file of faults and their times; see below")
        ->group("Faults");
    app.add_option("--control", flags.control_path,
                   "A Unix socket that takes faults while it runs; see below")
        ->group("Faults");
}

void add_time_flags(CLI::App& app, Flags& flags) {
    CLI::Option* scale = app.add_option("--time-scale", flags.time_scale, "Simulated seconds a real second")
                             ->check(number_in(1e-3, 1e6))
                             ->capture_default_str()
                             ->group("Time");
    CLI::Option* epoch =
        app.add_option("--time-epoch-ns", flags.time_epoch_ns,
                       "CLOCK_MONOTONIC, ns, at simulated time 0; default: the start of the program")
            ->group("Time");
    app.add_option("--lockstep", flags.lockstep_s,
                   "No clock: every read of the first unit's first register moves time on by so many s")
        ->check(number_in(1e-3, 1e6))
        ->excludes(scale)
        ->excludes(epoch)
        ->group("Time");
}

void add_offline_flags(CLI::App& app, Flags& flags) {
    app.add_flag("--truth", flags.truth, "Print where each channel really settles, and when; no server")
        ->group("Without a server");
    app.add_flag("--plant", flags.plant, "Print the plant's numbers as JSON; no server")
        ->group("Without a server");
    app.add_flag("--json", flags.json, "With --truth: one JSON document")->group("Without a server");
    app.add_option("--csv", flags.csv_path, "Write a recorded test of the plant, a row each 15 s; no server")
        ->group("Without a server");
    app.add_option("--duration-min", flags.duration_min, "Its length, min")
        ->check(number_in(0.25, 1e5))
        ->capture_default_str()
        ->group("Without a server");
}

std::unexpected<Error> refuse(std::string message) {
    return fail(NextStep::refuse_input, std::move(message));
}

Result<void> take_condition(const Flags& flags, SimulatorOptions& options) {
    const auto condition = find_condition(flags.condition);
    if (!condition) {
        return refuse(fmt::format("--condition '{}' is not known; it is one of {}", flags.condition,
                                  known_conditions()));
    }
    options.condition = condition->name;
    options.drive = condition->drive;
    if (flags.rpm) options.drive.spindle_rpm = *flags.rpm;
    if (flags.cutting) options.drive.cutting = true;
    options.room = flags.room;
    options.room.cycle_period_s = flags.room_cycle_period_min * 60.0;
    return {};
}

Result<void> take_module(const Flags& flags, SimulatorOptions& options) {
    auto map = find_register_map(flags.profile);
    if (!map) return refuse(fmt::format("--profile '{}' is not known; --help lists them", flags.profile));
    const auto order = word_order_from_string(flags.word_order);
    if (!order) {
        return refuse(fmt::format("--word-order '{}' is none of abcd, cdab, badc, dcba", flags.word_order));
    }
    map->word_order = *order;
    options.map = std::move(*map);
    auto units = parse_units(flags.units.empty() ? fewest_units(options.map.most_channels) : flags.units,
                             flags.first_unit, options.map.most_channels);
    if (!units) return std::unexpected(units.error());
    options.units = std::move(*units);
    options.foreign_unit = flags.foreign_unit == "silence" ? ForeignUnit::silence : ForeignUnit::exception_11;
    return {};
}

/// A fault that keeps requests away keeps time in lockstep from moving: it would never end.
Result<void> check_lockstep(const Flags& flags, const std::vector<Fault>& faults) {
    if (!flags.lockstep_s) return {};
    for (const Fault& fault : faults) {
        const bool keeps_requests_away =
            fault.place() == FaultPlace::endpoint && fault.kind != FaultKind::one_client;
        if (!keeps_requests_away || !std::isfinite(fault.to_s)) continue;
        return refuse(
            fmt::format("fault '{}' would never end: in --lockstep only requests move time, and it "
                        "keeps them away; use --time-scale, or end it over --control",
                        to_string(fault)));
    }
    return {};
}

Result<std::string> text_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    if (file.good() || file.eof()) return text;
    return refuse(fmt::format("{}: cannot be read; name a scenario file", path));
}

Result<void> take_faults(const Flags& flags, SimulatorOptions& options) {
    for (const std::string& text : flags.faults) {
        auto fault = parse_fault(text);
        if (!fault) return std::unexpected(fault.error());
        options.faults.push_back(*fault);
    }
    if (!flags.scenario_path.empty()) {
        const auto text = text_of(flags.scenario_path);
        if (!text) return std::unexpected(text.error());
        const auto scenario = parse_scenario(*text, flags.scenario_path);
        if (!scenario) return std::unexpected(scenario.error());
        options.faults.insert(options.faults.end(), scenario->begin(), scenario->end());
    }
    const FaultReach reach = options.fault_reach();
    for (const Fault& fault : options.faults) {
        if (auto acts = check_reach(fault, reach); !acts) return acts;
    }
    options.control_path = flags.control_path;
    return check_lockstep(flags, options.faults);
}

Result<SimulatorTask> task_of(const Flags& flags) {
    const int offline = int{flags.truth} + int{flags.plant} + int{!flags.csv_path.empty()};
    if (offline > 1) return refuse("--truth, --plant and --csv exclude each other; give one of them");
    if (offline == 1 && flags.rtu)
        return refuse("--rtu serves and --truth, --plant, --csv do not; give one of them");
    if (offline == 1 && !flags.replay_path.empty()) {
        return refuse(
            "--replay serves a recording; --truth, --plant and --csv ask the plant; give one of them");
    }
    if (!flags.bind.empty() && flags.bind != "127.0.0.1" && flags.bind != "::1" &&
        flags.bind != "localhost") {
        return refuse(fmt::format("--bind '{}': the simulator listens on loopback only (127.0.0.1 and ::1)",
                                  flags.bind));
    }
    if (!flags.link_path.empty() && !flags.rtu)
        return refuse("--link names a pseudo-terminal; it needs --rtu");
    if (flags.truth) return SimulatorTask::print_truth;
    if (flags.plant) return SimulatorTask::print_plant;
    if (!flags.csv_path.empty()) return SimulatorTask::write_csv;
    return flags.rtu ? SimulatorTask::serve_rtu : SimulatorTask::serve_tcp;
}

Result<SimulatorOptions> checked(const Flags& flags) {
    SimulatorOptions options;
    const auto task = task_of(flags);
    if (!task) return std::unexpected(task.error());
    options.task = *task;
    if (auto taken = take_condition(flags, options); !taken) return std::unexpected(taken.error());
    if (auto taken = take_module(flags, options); !taken) return std::unexpected(taken.error());
    if (auto taken = take_faults(flags, options); !taken) return std::unexpected(taken.error());
    options.json = flags.json;
    options.noise = flags.noise;
    options.replay_path = flags.replay_path;
    options.csv_path = flags.csv_path;
    options.duration_s = flags.duration_min * 60.0;
    options.port = static_cast<std::uint16_t>(flags.port);
    options.link_path = flags.link_path;
    options.truth_log_path = flags.truth_log_path;
    options.lockstep_s = flags.lockstep_s;
    options.time_scale = flags.time_scale;
    options.time_epoch_ns = flags.time_epoch_ns;
    options.spindle_start_s = flags.spindle_start_s;
    return options;
}

/// What --help and --version printed may have met a full disk.
int answered(int status) {
    const auto printed = print_out("");
    if (printed) return status;
    print_error_line("thermbal-sim: " + printed.error().message);
    return 1;
}

}  // namespace

FaultReach SimulatorOptions::fault_reach() const {
    if (task != SimulatorTask::serve_tcp && task != SimulatorTask::serve_rtu) return {};
    FaultReach reach{.framing = task == SimulatorTask::serve_rtu ? FaultFraming::rtu : FaultFraming::tcp,
                     .channels = 0};
    for (const ModuleUnit& unit : units) {
        reach.units.push_back(unit.id);
        reach.channels = std::max(reach.channels, unit.first_channel + unit.channels);
    }
    return reach;
}

Result<std::vector<ModuleUnit>> parse_units(const std::string& text, int first_id,
                                            std::size_t most_channels) {
    std::vector<ModuleUnit> units;
    std::size_t channels = 0;
    for (const std::string& part : CLI::detail::split(text, ',')) {
        std::size_t count = 0;
        if (!CLI::detail::lexical_cast(part, count) || count < 1 || count > most_channels) {
            return refuse(
                fmt::format("--units '{}': '{}' is no number of channels from 1 to {} (the profile's most)",
                            text, part, most_channels));
        }
        const int id = first_id + static_cast<int>(units.size());
        if (id > 247) return refuse(fmt::format("--units '{}': unit ids end at 247", text));
        if (channels == all_channels) channels = 0;  // one more module on the same sensors
        units.push_back({.id = static_cast<std::uint8_t>(id), .first_channel = channels, .channels = count});
        channels += count;
        if (channels > all_channels) {
            return refuse(
                fmt::format("--units '{}' are {} channels; there are {}, and a unit ends with the last", text,
                            channels, all_channels));
        }
    }
    return units;
}

ParsedCommandLine parse_command_line(int argc, char** argv) {
    CLI::App app{
        "thermbal-sim: a Modbus module with 16 PT100 inputs on a spindle head that warms up.\n"
        "It listens on loopback only, prints 'ready ...' on standard output, and ends on SIGTERM or SIGINT.",
        "thermbal-sim"};
    app.set_version_flag("--version", "thermbal-sim " THERMBAL_VERSION);
    app.footer("Profiles (addresses from 0):\n" + known_profiles() +
               "Faults, with times in s on the simulated clock, e.g. open:T7@3600 or exception=4:2@600-900 "
               "(unit 2);\n"
               "without TARGET it acts on all channels or units; the first one of a place that is active "
               "decides:\n" +
               fault_help() +
               "A --scenario holds tables [[fault]] with kind, at_s, and where they apply value, unit, "
               "channel, for_s.\n"
               "--control takes lines and answers each with 'ok ...' or 'error ...', e.g. by nc -U SOCKET:\n"
               "  fault KIND[=VALUE][:TARGET] [SECONDS]   from now on (in lockstep: from the next scan on)\n"
               "  clear [KIND]    list    time\n"
               "Exit status: 0 ended as asked, 1 a failure at run time, 2 wrong usage.");
    Flags flags;
    add_source_flags(app, flags);
    add_line_flags(app, flags);
    add_fault_flags(app, flags);
    add_time_flags(app, flags);
    add_offline_flags(app, flags);
    add_manual_flags(app, {.see_also = "thermbald(8), thermbalctl(1)"});
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return {.options = {}, .exit_status = answered(app.exit(error))};
        print_error_line(fmt::format("thermbal-sim: {}; see --help", error.what()));
        return {.options = {}, .exit_status = 2};
    }
    auto options = checked(flags);
    if (!options) {
        print_error_line("thermbal-sim: " + options.error().message);
        return {.options = {}, .exit_status = 2};
    }
    return {.options = std::move(*options), .exit_status = 0};
}

}  // namespace thermbal
