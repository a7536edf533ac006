#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "simulator/frames.hpp"
#include "simulator/register_map.hpp"

namespace thermbal {

enum class FaultKind : std::uint8_t {
    open,               ///< sensor: the module's code for a broken lead
    shorted,            ///< sensor: the module's code for a short
    silence,            ///< no reply
    exception,          ///< exception `value` instead of the reply
    late,               ///< the reply comes `value` real seconds late
    hang_up,            ///< TCP: the connection is closed instead of a reply; RTU: no reply
    truncated,          ///< the last bytes of the reply are missing
    wrong_crc,          ///< RTU only
    wrong_transaction,  ///< TCP only
    wrong_unit,         ///< the reply carries another unit id
};

/// What goes wrong, where, and from when to when on the simulated clock.
struct Fault {
    FaultKind kind = FaultKind::silence;
    double value = 0.0;                       ///< exception code, or seconds late
    std::optional<std::size_t> channel = {};  ///< sensor faults: T1 is 0; nothing: every channel
    std::optional<std::uint8_t> unit = {};    ///< faults of the line; nothing: every unit
    double from_s = 0.0;
    double to_s = std::numeric_limits<double>::infinity();

    bool on_sensor() const { return kind == FaultKind::open || kind == FaultKind::shorted; }
    bool active(double time_s) const { return time_s >= from_s && time_s < to_s; }
};

std::string_view to_string(FaultKind kind);

/// `KIND[=VALUE][:TARGET]@FROM_S[-TO_S]`, e.g. `open:T7@3600`, `exception=4:2@600-900` (unit 2),
/// `late=0.3@0-60`.
Result<Fault> parse_fault(std::string_view text);

/// The state of one sensor; the first fault of the list that is active decides.
SensorState sensor_state(const std::vector<Fault>& faults, std::size_t channel, double time_s);
/// What is wrong on the line to a unit; the first fault of the list that is active decides.
std::optional<Fault> line_fault(const std::vector<Fault>& faults, std::uint8_t unit, double time_s);

/// Bytes to send after a delay, then perhaps the end of the connection.
struct Delivery {
    double delay_s = 0.0;
    Bytes bytes = {};
    bool hang_up = false;
};

/// How the reply `pdu` to a request goes over the wire, with a fault on it. A fault that the framing does not
/// know (a CRC over TCP, a transaction over RTU) leaves the reply as it is.
std::vector<Delivery> deliveries(Framing framing, const ModbusRequest& request, const Bytes& pdu,
                                 const std::optional<Fault>& fault);

}  // namespace thermbal
