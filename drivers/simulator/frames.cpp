#include "simulator/frames.hpp"

#include <optional>

namespace thermbal {
namespace {

constexpr std::size_t mbap_size = 7;
constexpr std::size_t longest_rtu_frame = 256;
constexpr std::uint16_t longest_tcp_length = 254;  // unit and a PDU of at most 253 bytes

std::uint16_t big_endian(ByteView bytes, std::size_t at) {
    return static_cast<std::uint16_t>((bytes[at] << 8U) | bytes[at + 1]);
}

void append_big_endian(Bytes& bytes, std::uint16_t value) {
    bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
    bytes.push_back(static_cast<std::uint8_t>(value & 0xFFU));
}

enum class Length : std::uint8_t { known, later, unknown };

struct ExpectedLength {
    Length state = Length::unknown;
    std::size_t bytes = 0;
};

/// Length of a whole RTU request with unit and CRC.
ExpectedLength expected_rtu_length(ByteView received) {
    if (received.size() < 2) return {Length::later, 0};
    const auto counted = [&received](std::size_t count_at) -> ExpectedLength {
        if (received.size() <= count_at) return {Length::later, 0};
        return {Length::known, count_at + 1 + received[count_at] + 2};
    };
    switch (received[1]) {
        case 1:
        case 2:
        case 3:
        case 4:
        case 5:
        case 6:
        case 8:
            return {Length::known, 8};
        case 7:
        case 11:
        case 12:
        case 17:
            return {Length::known, 4};
        case 15:
        case 16:
            return counted(6);
        case 22:
            return {Length::known, 10};
        case 23:
            return counted(10);
        default:
            return {};
    }
}

std::optional<ModbusRequest> checked_rtu_request(ByteView frame) {
    if (frame.size() < 4 || frame.size() > longest_rtu_frame) return std::nullopt;
    const ByteView body = frame.first(frame.size() - 2);
    const std::uint16_t crc = modbus_crc(body);
    if (frame[frame.size() - 2] != (crc & 0xFFU) || frame[frame.size() - 1] != (crc >> 8U))
        return std::nullopt;
    return ModbusRequest{.transaction = 0, .unit = body[0], .pdu = Bytes(body.begin() + 1, body.end())};
}

ParsedRequest garbage(std::size_t bytes) {
    return {.kind = ParsedRequest::Kind::garbage, .consumed = bytes, .request = {}};
}

ParsedRequest whole_buffer(ByteView received) {
    if (received.empty()) return {};
    auto request = checked_rtu_request(received);
    if (!request) return garbage(received.size());
    return {
        .kind = ParsedRequest::Kind::request, .consumed = received.size(), .request = std::move(*request)};
}

}  // namespace

ParsedRequest parse_tcp_request(ByteView received) {
    if (received.size() < mbap_size + 1) return {};
    const std::uint16_t protocol = big_endian(received, 2);
    const std::uint16_t length = big_endian(received, 4);
    if (protocol != 0 || length < 2 || length > longest_tcp_length) {
        return {.kind = ParsedRequest::Kind::broken, .consumed = received.size(), .request = {}};
    }
    const std::size_t whole = mbap_size - 1 + length;
    if (received.size() < whole) return {};
    const ByteView pdu = received.subspan(mbap_size, whole - mbap_size);
    return {.kind = ParsedRequest::Kind::request,
            .consumed = whole,
            .request = {.transaction = big_endian(received, 0),
                        .unit = received[mbap_size - 1],
                        .pdu = Bytes(pdu.begin(), pdu.end())}};
}

ParsedRequest parse_rtu_request(ByteView received, bool silence) {
    const ExpectedLength expected = expected_rtu_length(received);
    if (expected.state == Length::known && expected.bytes > longest_rtu_frame) return garbage(1);
    if (expected.state == Length::known && received.size() >= expected.bytes) {
        auto request = checked_rtu_request(received.first(expected.bytes));
        if (!request) return garbage(1);
        return {
            .kind = ParsedRequest::Kind::request, .consumed = expected.bytes, .request = std::move(*request)};
    }
    if (silence) return whole_buffer(received);
    if (received.size() > longest_rtu_frame) return garbage(1);
    return {};
}

std::uint16_t modbus_crc(ByteView bytes) {
    std::uint16_t crc = 0xFFFF;
    for (const std::uint8_t byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) {
            const bool carry = (crc & 1U) != 0;
            crc = static_cast<std::uint16_t>(crc >> 1U);
            if (carry) crc ^= 0xA001;
        }
    }
    return crc;
}

Bytes tcp_frame(std::uint16_t transaction, std::uint8_t unit, ByteView pdu) {
    Bytes frame;
    frame.reserve(mbap_size + pdu.size());
    append_big_endian(frame, transaction);
    append_big_endian(frame, 0);
    append_big_endian(frame, static_cast<std::uint16_t>(pdu.size() + 1));
    frame.push_back(unit);
    frame.insert(frame.end(), pdu.begin(), pdu.end());
    return frame;
}

Bytes rtu_frame(std::uint8_t unit, ByteView pdu) {
    Bytes frame;
    frame.reserve(pdu.size() + 3);
    frame.push_back(unit);
    frame.insert(frame.end(), pdu.begin(), pdu.end());
    const std::uint16_t crc = modbus_crc(frame);
    frame.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
    frame.push_back(static_cast<std::uint8_t>(crc >> 8U));
    return frame;
}

}  // namespace thermbal
