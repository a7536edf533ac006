#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

/// A request as Modbus Application Protocol V1.1b3 knows it: functions 3, 4 (count registers from address),
/// 5, 6 (value at address; a coil is 0xFF00 or 0).
struct Request {
    int unit_id = 1;
    int function = 3;
    int address = 0;
    int count_or_value = 1;
};

/// Function code and data.
std::vector<std::uint8_t> request_pdu(const Request& request);

/// MBAP header and PDU, as it goes over Modbus TCP.
std::vector<std::uint8_t> tcp_frame(std::uint16_t transaction_id, const Request& request);

/// The PDU inside a Modbus TCP reply: transaction id, protocol id, length field and unit have to be those of
/// the request, or the frame is an error (reopen_link).
Result<std::span<const std::uint8_t>> pdu_of_tcp_reply(std::span<const std::uint8_t> frame,
                                                       std::uint16_t transaction_id, int unit_id);

/// The PDU inside an RTU reply whose CRC has been checked: the unit has to be that of the request.
Result<std::span<const std::uint8_t>> pdu_of_rtu_reply(std::span<const std::uint8_t> frame, int unit_id);

/// The registers of a reply (functions 3, 4), or nothing (5, 6). Errors: a Modbus exception is `retry`, a PDU
/// that does not answer this request `reopen_link`.
Result<std::vector<std::uint16_t>> check_reply(const Request& request, std::span<const std::uint8_t> pdu);

}  // namespace thermbal
