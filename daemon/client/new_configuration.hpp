#pragma once

#include <string>
#include <vector>

#include "modbus/link.hpp"

namespace thermbal {

/// What a configuration is written from. The defaults are those of the daemon.
struct NewConfiguration {
    struct Unit {
        int unit_id = 1;
        std::string profile;
    };
    struct Channel {
        std::string name;  ///< T1, T2, ...
        std::size_t unit = 0;
        int input = 1;
        bool ambient = false;
        std::string place;
    };

    std::string test_name = "thermal balance";
    std::string machine;
    bool start_automatically = false;
    std::string database = "/var/lib/thermbal/thermbal.db";
    std::string socket = "/run/thermbal/thermbald.sock";
    std::string log_level = "info";
    bool sweep_always = true;
    std::string stop_toml =
        "action = \"none\"             # or \"command\", \"write_coil\", \"write_register\"\n";
    LinkOptions link;
    std::vector<Unit> units;
    std::vector<Channel> channels;
};

/// T1 ... of all inputs of the units in their order, at most `most` channels; `ambient` names the one that
/// measures the room, or is "none". `inputs[k]` belongs to unit k.
std::vector<NewConfiguration::Channel> channels_of_inputs(const std::vector<int>& inputs, std::size_t most,
                                                          const std::string& ambient);

/// The line, its units and their channels as TOML.
std::string modules_text(const NewConfiguration& wanted);

/// A commented configuration that load_config accepts as long as the profiles are there.
std::string configuration_text(const NewConfiguration& wanted);

}  // namespace thermbal
