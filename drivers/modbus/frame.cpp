#include "modbus/frame.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

namespace thermbal {
namespace {

constexpr std::size_t mbap_length = 7;
constexpr std::size_t rtu_header_length = 1;
constexpr std::size_t crc_length = 2;

std::uint8_t high(int value) {
    return static_cast<std::uint8_t>((value >> 8) & 0xFF);
}
std::uint8_t low(int value) {
    return static_cast<std::uint8_t>(value & 0xFF);
}

std::uint16_t word(std::span<const std::uint8_t> bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

std::string_view exception_name(int code) {
    switch (code) {
        case 1:
            return "illegal function";
        case 2:
            return "illegal data address";
        case 3:
            return "illegal data value";
        case 4:
            return "device failure";
        case 5:
            return "acknowledged, still working";
        case 6:
            return "device busy";
        case 7:
            return "negative acknowledge";
        case 8:
            return "memory parity error";
        case 10:
            return "gateway path unavailable";
        case 11:
            return "gateway: the unit behind it does not respond";
        default:
            return "not a code of the standard";
    }
}

std::string describe(const Request& request) {
    if (request.function == 3 || request.function == 4) {
        return fmt::format("function {}, registers {} to {}", request.function, request.address,
                           request.address + request.count_or_value - 1);
    }
    return fmt::format("function {}, address {}", request.function, request.address);
}

std::unexpected<Error> doubt(std::string message) {
    return fail(NextStep::reopen_link, std::move(message));
}

Result<std::vector<std::uint16_t>> registers_of(const Request& request, std::span<const std::uint8_t> pdu) {
    const auto expected = static_cast<std::size_t>(request.count_or_value) * 2;
    if (pdu.size() < 2 || pdu[1] != expected || pdu.size() != 2 + expected) {
        return doubt(fmt::format("unit {} sent {} bytes instead of {} for {}", request.unit_id,
                                 pdu.size() < 2 ? 0 : pdu.size() - 2, expected, describe(request)));
    }
    std::vector<std::uint16_t> registers;
    registers.reserve(expected / 2);
    for (std::size_t at = 2; at < pdu.size(); at += 2) registers.push_back(word(pdu, at));
    return registers;
}

}  // namespace

std::vector<std::uint8_t> request_pdu(const Request& request) {
    return {low(request.function), high(request.address), low(request.address), high(request.count_or_value),
            low(request.count_or_value)};
}

std::vector<std::uint8_t> tcp_frame(std::uint16_t transaction_id, const Request& request) {
    const std::vector<std::uint8_t> pdu = request_pdu(request);
    const int length = static_cast<int>(pdu.size()) + 1;
    std::vector<std::uint8_t> frame;
    frame.reserve(mbap_length + pdu.size());
    for (const int value : {int{transaction_id}, 0, length}) {
        frame.push_back(high(value));
        frame.push_back(low(value));
    }
    frame.push_back(low(request.unit_id));
    for (const std::uint8_t byte : pdu) frame.push_back(byte);
    return frame;
}

Result<std::span<const std::uint8_t>> pdu_of_tcp_reply(std::span<const std::uint8_t> frame,
                                                       std::uint16_t transaction_id, int unit_id) {
    if (frame.size() <= mbap_length) return doubt(fmt::format("a reply of {} bytes", frame.size()));
    if (word(frame, 0) != transaction_id) {
        return doubt(
            fmt::format("a reply to transaction {} while {} was asked for: it belongs to another request",
                        word(frame, 0), transaction_id));
    }
    if (word(frame, 2) != 0) return doubt(fmt::format("protocol id {} instead of 0", word(frame, 2)));
    if (word(frame, 4) != frame.size() - 6) {
        return doubt(
            fmt::format("a length field of {} on a reply of {} bytes", word(frame, 4), frame.size() - 6));
    }
    if (frame[6] != unit_id) {
        return doubt(fmt::format("a reply of unit {} while unit {} was asked", frame[6], unit_id));
    }
    return frame.subspan(mbap_length);
}

Result<std::span<const std::uint8_t>> pdu_of_rtu_reply(std::span<const std::uint8_t> frame, int unit_id) {
    if (frame.size() <= rtu_header_length + crc_length) {
        return doubt(fmt::format("a reply of {} bytes", frame.size()));
    }
    if (frame[0] != unit_id) {
        return doubt(fmt::format("a reply of unit {} while unit {} was asked", frame[0], unit_id));
    }
    return frame.subspan(rtu_header_length, frame.size() - rtu_header_length - crc_length);
}

Result<std::vector<std::uint16_t>> check_reply(const Request& request, std::span<const std::uint8_t> pdu) {
    if (pdu.empty()) return doubt("an empty reply");
    if (pdu[0] == (request.function | 0x80)) {
        if (pdu.size() != 2) return doubt(fmt::format("an exception of {} bytes", pdu.size()));
        return fail(NextStep::retry, fmt::format("unit {} answered exception {} ({}) to {}", request.unit_id,
                                                 pdu[1], exception_name(pdu[1]), describe(request)));
    }
    if (pdu[0] != request.function) {
        return doubt(
            fmt::format("unit {} answered function {} to {}", request.unit_id, pdu[0], describe(request)));
    }
    if (request.function == 3 || request.function == 4) return registers_of(request, pdu);
    const std::vector<std::uint8_t> echo = request_pdu(request);
    if (!std::equal(pdu.begin(), pdu.end(), echo.begin(), echo.end())) {
        return doubt(
            fmt::format("unit {} confirmed something else than {}", request.unit_id, describe(request)));
    }
    return std::vector<std::uint16_t>{};
}

}  // namespace thermbal
