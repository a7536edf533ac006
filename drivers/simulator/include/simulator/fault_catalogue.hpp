#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace thermbal {

enum class FaultKind : std::uint8_t {
    open,
    shorted,
    code,
    frozen,
    silence,
    late,
    truncated,
    trickle,
    duplicate,
    wrong_crc,
    wrong_transaction,
    wrong_unit,
    wrong_function,
    wrong_length,
    wrong_count,
    echo,
    unsolicited,
    noise,
    exception,
    hang_up,
    refuse,
    half_open,
    one_client,
    unplug,
};

/// Where a fault acts, and so what its target is.
enum class FaultPlace : std::uint8_t {
    sensor,    ///< one channel, or all
    module,    ///< what a unit measures
    reply,     ///< how a unit's reply goes over the wire
    endpoint,  ///< the socket or the serial port itself; no target
};

enum class FaultFraming : std::uint8_t { any, tcp, rtu };

/// The number behind KIND=. `name` empty: the fault takes none.
struct FaultValue {
    std::string_view name = {};
    double usual = 0.0;  ///< without =VALUE
    double least = 0.0;
    double most = 0.0;
    bool whole = false;
    bool required = false;
};

struct FaultEntry {
    FaultKind kind;
    std::string_view name;  ///< as in --fault, in a scenario and over the control socket
    FaultPlace place;
    FaultFraming framing;  ///< another framing leaves the reply or the endpoint as it is
    FaultValue value;
    std::string_view what;
};

/// Every fault that the simulator knows, in the order of --help.
std::span<const FaultEntry> fault_catalogue();
const FaultEntry& entry_of(FaultKind kind);
/// Null when there is no such fault.
const FaultEntry* find_fault(std::string_view name);
/// A line a fault, for --help.
std::string fault_help();

}  // namespace thermbal
