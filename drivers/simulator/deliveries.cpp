#include "simulator/deliveries.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace thermbal {
namespace {

constexpr std::size_t pdu_head = 2;  // function, byte count

/// A reply on its way out, and what a fault may bend.
struct Outgoing {
    Framing framing;
    const ModbusRequest& request;
    const Bytes& pdu;

    Bytes frame(std::uint16_t transaction, std::uint8_t unit, const Bytes& with_pdu) const {
        return framing == Framing::tcp ? tcp_frame(transaction, unit, with_pdu) : rtu_frame(unit, with_pdu);
    }
    Bytes frame(const Bytes& with_pdu) const { return frame(request.transaction, request.unit, with_pdu); }
    Bytes plain() const { return frame(pdu); }
    /// A reply to a read of registers or coils, which counts its bytes.
    bool is_read() const { return pdu.size() > pdu_head && pdu.size() == pdu_head + pdu[1]; }
};

using Deliveries = std::vector<Delivery>;

Deliveries at_once(Bytes bytes) {
    return {{.delay_s = 0.0, .bytes = std::move(bytes)}};
}

Deliveries silence(const Outgoing& /*reply*/, double /*value*/, std::mt19937_64& /*random*/) {
    return {};
}

Deliveries exception(const Outgoing& reply, double code, std::mt19937_64& /*random*/) {
    return at_once(reply.frame(
        {static_cast<std::uint8_t>(reply.request.pdu.front() | 0x80U), static_cast<std::uint8_t>(code)}));
}

Deliveries late(const Outgoing& reply, double late_s, std::mt19937_64& /*random*/) {
    return {{.delay_s = late_s, .bytes = reply.plain()}};
}

Deliveries hang_up(const Outgoing& reply, double /*value*/, std::mt19937_64& /*random*/) {
    if (reply.framing == Framing::rtu) return {};
    return {{.delay_s = 0.0, .bytes = {}, .hang_up = true}};
}

Deliveries truncated(const Outgoing& reply, double /*value*/, std::mt19937_64& /*random*/) {
    Bytes bytes = reply.plain();
    bytes.resize(bytes.size() - std::min<std::size_t>(3, bytes.size() - 1));
    return at_once(std::move(bytes));
}

Deliveries trickle(const Outgoing& reply, double apart_s, std::mt19937_64& /*random*/) {
    Deliveries bytes;
    for (const std::uint8_t byte : reply.plain()) {
        bytes.push_back({.delay_s = apart_s * static_cast<double>(bytes.size()), .bytes = {byte}});
    }
    return bytes;
}

Deliveries duplicate(const Outgoing& reply, double later_s, std::mt19937_64& /*random*/) {
    return {{.delay_s = 0.0, .bytes = reply.plain()}, {.delay_s = later_s, .bytes = reply.plain()}};
}

Deliveries wrong_crc(const Outgoing& reply, double /*value*/, std::mt19937_64& /*random*/) {
    Bytes bytes = reply.plain();
    if (reply.framing == Framing::rtu) bytes.back() ^= 0x5AU;
    return at_once(std::move(bytes));
}

Deliveries wrong_transaction(const Outgoing& reply, double /*value*/, std::mt19937_64& /*random*/) {
    const auto other = static_cast<std::uint16_t>(reply.request.transaction + 1);
    return at_once(reply.frame(other, reply.request.unit, reply.pdu));
}

Deliveries wrong_unit(const Outgoing& reply, double /*value*/, std::mt19937_64& /*random*/) {
    const auto other = static_cast<std::uint8_t>(reply.request.unit + 1);
    return at_once(reply.frame(reply.request.transaction, other, reply.pdu));
}

Deliveries wrong_function(const Outgoing& reply, double /*value*/, std::mt19937_64& /*random*/) {
    Bytes pdu = reply.pdu;
    pdu.front() = pdu.front() == 3 ? 4 : 3;
    return at_once(reply.frame(pdu));
}

Deliveries wrong_length(const Outgoing& reply, double /*value*/, std::mt19937_64& /*random*/) {
    Bytes pdu = reply.pdu;
    const bool can_lose_a_register = reply.is_read() && pdu[1] > 2;
    if (can_lose_a_register) {
        pdu.resize(pdu.size() - 2);
        pdu[1] = static_cast<std::uint8_t>(pdu[1] - 2);
    } else {
        pdu.push_back(0);
        if (reply.is_read()) ++pdu[1];
    }
    return at_once(reply.frame(pdu));
}

Deliveries wrong_count(const Outgoing& reply, double /*value*/, std::mt19937_64& /*random*/) {
    Bytes pdu = reply.pdu;
    if (reply.is_read()) pdu[1] = static_cast<std::uint8_t>(pdu[1] + 2);
    return at_once(reply.frame(pdu));
}

Deliveries echo(const Outgoing& reply, double /*value*/, std::mt19937_64& /*random*/) {
    Bytes bytes = reply.frame(reply.request.pdu);
    const Bytes answer = reply.plain();
    bytes.insert(bytes.end(), answer.begin(), answer.end());
    return at_once(std::move(bytes));
}

Deliveries unsolicited(const Outgoing& reply, double later_s, std::mt19937_64& /*random*/) {
    Bytes other = reply.pdu;
    // Every register a few counts higher: a temperature that anybody would believe.
    for (std::size_t low = pdu_head + 1; reply.is_read() && low < other.size(); low += 2) {
        other[low] = static_cast<std::uint8_t>(other[low] + 7);
    }
    return {{.delay_s = 0.0, .bytes = reply.plain()}, {.delay_s = later_s, .bytes = reply.frame(other)}};
}

Deliveries noise(const Outgoing& reply, double how_many, std::mt19937_64& random) {
    Bytes bytes(static_cast<std::size_t>(how_many));
    std::ranges::generate(bytes, [&random] { return static_cast<std::uint8_t>(random() & 0xFFU); });
    const Bytes answer = reply.plain();
    bytes.insert(bytes.end(), answer.begin(), answer.end());
    return at_once(std::move(bytes));
}

struct Bending {
    FaultKind kind;
    Deliveries (*bend)(const Outgoing& reply, double value, std::mt19937_64& random);
};

constexpr std::array<Bending, 16> bendings = {{
    {FaultKind::silence, silence},
    {FaultKind::late, late},
    {FaultKind::truncated, truncated},
    {FaultKind::trickle, trickle},
    {FaultKind::duplicate, duplicate},
    {FaultKind::wrong_crc, wrong_crc},
    {FaultKind::wrong_transaction, wrong_transaction},
    {FaultKind::wrong_unit, wrong_unit},
    {FaultKind::wrong_function, wrong_function},
    {FaultKind::wrong_length, wrong_length},
    {FaultKind::wrong_count, wrong_count},
    {FaultKind::echo, echo},
    {FaultKind::unsolicited, unsolicited},
    {FaultKind::noise, noise},
    {FaultKind::exception, exception},
    {FaultKind::hang_up, hang_up},
}};

}  // namespace

std::vector<Delivery> deliveries(Framing framing, const ModbusRequest& request, const Bytes& pdu,
                                 const std::optional<Fault>& fault, std::mt19937_64& random) {
    const Outgoing reply{.framing = framing, .request = request, .pdu = pdu};
    if (!fault) return at_once(reply.plain());
    const auto found = std::ranges::find(bendings, fault->kind, &Bending::kind);
    if (found == bendings.end()) return at_once(reply.plain());
    return found->bend(reply, fault->value, random);
}

}  // namespace thermbal
