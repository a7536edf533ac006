#pragma once

#include <string>
#include <vector>

#include "modbus/link.hpp"
#include "modbus/profile.hpp"
#include "readings.hpp"

namespace thermbal {

struct ProbeOptions {
    LinkOptions link;            ///< of a serial line: device only, the rest from the lists below
    std::vector<int> bauds;      ///< serial: tried in this order
    std::string parities = "N";  ///< serial: of N, E, O
    int first_unit = 1;
    int last_unit = 8;
    int last_register = 127;  ///< looked at from 0 on, with functions 3 and 4
    double limit_s = 60.0;    ///< the whole probe; what was not reached by then is said
    std::vector<ModuleProfile> profiles;
};

/// A known profile whose registers are there.
struct ProfileFit {
    ModuleProfile profile;
    double fit = 0.0;  ///< share of inputs that read like temperatures or its fault codes
    bool types_confirmed = false;
    std::string types;  ///< what the type codes say; empty when the profile knows none
};

struct ProbedUnit {
    LinkOptions link;  ///< the settings at which it answered
    int unit_id = 1;
    std::vector<RegisterBlock> blocks;
    std::vector<Reading> readings;  ///< of all blocks, best first
    std::vector<ProfileFit> fits;   ///< best first
};

struct ProbeResult {
    std::vector<ProbedUnit> units;
    std::vector<std::string> trouble;  ///< what could not be asked, one line each
    bool out_of_time = false;
    int requests = 0;
};

/// Asks with functions 3 and 4 only, one request at a time: nothing is ever written. Ends after limit_s and
/// one exchange.
ProbeResult probe(const ProbeOptions& options);

}  // namespace thermbal
