#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "simulator/faults.hpp"
#include "simulator/module.hpp"
#include "simulator/noise.hpp"
#include "simulator/plant.hpp"
#include "simulator/register_map.hpp"
#include "simulator/station.hpp"

namespace thermbal {

enum class SimulatorTask : std::uint8_t { serve_tcp, serve_rtu, print_truth, print_plant, write_csv };

/// What the command line asks for, checked.
struct SimulatorOptions {
    SimulatorTask task = SimulatorTask::serve_tcp;
    bool json = false;

    std::string condition;
    Drive drive;
    Room room;
    NoiseOptions noise;
    std::string replay_path;  ///< empty: the plant
    std::string csv_path;
    double duration_s = 0.0;

    std::uint16_t port = 0;
    std::string link_path;
    RegisterMap map;
    std::vector<ModuleUnit> units;
    ForeignUnit foreign_unit = ForeignUnit::exception_11;
    std::vector<Fault> faults;  ///< of --fault and of the scenario
    std::string control_path;
    std::string truth_log_path;

    std::optional<double> lockstep_s;
    double time_scale = 1.0;
    std::optional<std::int64_t> time_epoch_ns;
    double spindle_start_s = 0.0;

    /// What is served.
    FaultReach fault_reach() const;
};

/// Either options, or the exit status that the program ends with at once (--help, --version: 0; wrong usage:
/// 2, and the message is on standard error).
struct ParsedCommandLine {
    std::optional<SimulatorOptions> options;
    int exit_status = 0;
};

ParsedCommandLine parse_command_line(int argc, char** argv);

/// `8,8` as two units of 8 channels with ids from `first_id`. Errors: refuse_input.
Result<std::vector<ModuleUnit>> parse_units(const std::string& text, int first_id, std::size_t most_channels);

}  // namespace thermbal
