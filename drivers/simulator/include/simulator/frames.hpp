#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace thermbal {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

enum class Framing : std::uint8_t { tcp, rtu };

/// A request as the wire carried it. `pdu`: function code and data, at least one byte.
struct ModbusRequest {
    std::uint16_t transaction = 0;  ///< TCP only
    std::uint8_t unit = 0;
    Bytes pdu;
};

/// What stands at the beginning of received bytes.
struct ParsedRequest {
    enum class Kind : std::uint8_t {
        incomplete,  ///< wait for more; nothing is consumed
        request,     ///< `consumed` bytes were `request`
        garbage,     ///< `consumed` bytes are no request: drop them
        broken,      ///< TCP only: the stream cannot be followed any more, hang up
    };
    Kind kind = Kind::incomplete;
    std::size_t consumed = 0;
    ModbusRequest request;
};

/// Modbus TCP: MBAP header (transaction, protocol 0, length, unit) and PDU. Pure; any bytes are allowed.
ParsedRequest parse_tcp_request(ByteView received);

/// Modbus RTU. A request ends where its function code says it does, because a pseudo-terminal has no
/// character time; `silence` (at least 3.5 characters) ends a frame of an unknown function code, and drops an
/// unfinished one. Bytes that fail their CRC are skipped one by one until a request fits. Pure; any bytes are
/// allowed.
ParsedRequest parse_rtu_request(ByteView received, bool silence);

/// CRC-16/MODBUS, low byte first on the wire.
std::uint16_t modbus_crc(ByteView bytes);

Bytes tcp_frame(std::uint16_t transaction, std::uint8_t unit, ByteView pdu);
Bytes rtu_frame(std::uint8_t unit, ByteView pdu);

}  // namespace thermbal
