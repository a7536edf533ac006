#pragma once

#include <optional>
#include <random>
#include <vector>

#include "simulator/faults.hpp"
#include "simulator/frames.hpp"

namespace thermbal {

/// Bytes to send after a delay, then perhaps the end of the connection.
struct Delivery {
    double delay_s = 0.0;
    Bytes bytes = {};
    bool hang_up = false;
};

/// How the reply `pdu` to a request goes over the wire, with a fault of place `reply` on it. A fault that the
/// framing does not know (a CRC over TCP, a transaction over RTU) leaves the reply as it is. `random` is for
/// noise alone.
std::vector<Delivery> deliveries(Framing framing, const ModbusRequest& request, const Bytes& pdu,
                                 const std::optional<Fault>& fault, std::mt19937_64& random);

}  // namespace thermbal
