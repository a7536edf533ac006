#include "simulator/faults.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace thermbal {
namespace {

constexpr std::array<std::pair<FaultKind, std::string_view>, 10> names = {{
    {FaultKind::open, "open"},
    {FaultKind::shorted, "short"},
    {FaultKind::silence, "silence"},
    {FaultKind::exception, "exception"},
    {FaultKind::late, "late"},
    {FaultKind::hang_up, "hangup"},
    {FaultKind::truncated, "truncated"},
    {FaultKind::wrong_crc, "wrong-crc"},
    {FaultKind::wrong_transaction, "wrong-tid"},
    {FaultKind::wrong_unit, "wrong-unit"},
}};

std::unexpected<Error> refuse(std::string_view text, std::string_view what) {
    return fail(
        NextStep::refuse_input,
        fmt::format("--fault '{}': {}; write KIND[=VALUE][:TARGET]@FROM_S[-TO_S], e.g. open:T7@3600 or "
                    "exception=4:2@600-900",
                    text, what));
}

std::optional<FaultKind> kind_from_string(std::string_view name) {
    for (const auto& [kind, known] : names) {
        if (name == known) return kind;
    }
    return std::nullopt;
}

template <typename Number>
std::optional<Number> number(std::string_view text) {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::optional<double> seconds(std::string_view text) {
    const auto value = number<double>(text);
    if (!value || !std::isfinite(*value) || *value < 0.0) return std::nullopt;
    return value;
}

/// Cuts `text` at the first `mark`; the part behind it is nothing when there is no mark.
std::pair<std::string_view, std::optional<std::string_view>> cut(std::string_view text, char mark) {
    const std::size_t at = text.find(mark);
    if (at == std::string_view::npos) return {text, std::nullopt};
    return {text.substr(0, at), text.substr(at + 1)};
}

double default_value(FaultKind kind) {
    if (kind == FaultKind::exception) return 4.0;
    if (kind == FaultKind::late) return 1.0;
    return 0.0;
}

bool value_fits(FaultKind kind, double value) {
    if (kind == FaultKind::exception) return value >= 1.0 && value <= 255.0 && value == std::floor(value);
    if (kind == FaultKind::late) return value <= 3600.0;
    return false;
}

Result<void> read_target(Fault& fault, std::string_view target, std::string_view text) {
    if (fault.on_sensor()) {
        const auto index = target.starts_with('T') ? number<std::size_t>(target.substr(1)) : std::nullopt;
        if (!index || *index < 1 || *index > 16) return refuse(text, "a sensor fault acts on T1 ... T16");
        fault.channel = *index - 1;
        return {};
    }
    const auto unit = number<std::uint8_t>(target);
    if (!unit || *unit < 1 || *unit > 247)
        return refuse(text, "a fault of the line acts on a unit 1 ... 247");
    fault.unit = unit;
    return {};
}

Result<void> read_times(Fault& fault, std::string_view times, std::string_view text) {
    const auto [from, to] = cut(times, '-');
    const auto from_s = seconds(from);
    if (!from_s) return refuse(text, "FROM_S is no time in seconds");
    fault.from_s = *from_s;
    if (!to) return {};
    const auto to_s = seconds(*to);
    if (!to_s || *to_s <= *from_s) return refuse(text, "TO_S is no later time in seconds");
    fault.to_s = *to_s;
    return {};
}

Bytes frame(Framing framing, std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu) {
    return framing == Framing::tcp ? tcp_frame(transaction, unit, pdu) : rtu_frame(unit, pdu);
}

}  // namespace

std::string_view to_string(FaultKind kind) {
    for (const auto& [known, name] : names) {
        if (kind == known) return name;
    }
    return "";
}

Result<Fault> parse_fault(std::string_view text) {
    const auto [what, times] = cut(text, '@');
    if (!times) return refuse(text, "it has no @FROM_S");
    const auto [kind_and_value, target] = cut(what, ':');
    const auto [kind_name, value] = cut(kind_and_value, '=');

    const auto kind = kind_from_string(kind_name);
    if (!kind) {
        return refuse(text,
                      fmt::format("'{}' is none of open, short, silence, exception, late, hangup, truncated, "
                                  "wrong-crc, wrong-tid, wrong-unit",
                                  kind_name));
    }
    Fault fault{.kind = *kind, .value = default_value(*kind), .channel = {}, .unit = {}};
    if (value) {
        const auto parsed = seconds(*value);
        if (!parsed || !value_fits(*kind, *parsed)) return refuse(text, "its VALUE does not fit");
        fault.value = *parsed;
    }
    if (target) {
        if (auto read = read_target(fault, *target, text); !read) return std::unexpected(read.error());
    }
    if (auto read = read_times(fault, *times, text); !read) return std::unexpected(read.error());
    return fault;
}

SensorState sensor_state(const std::vector<Fault>& faults, std::size_t channel, double time_s) {
    for (const Fault& fault : faults) {
        if (!fault.on_sensor() || !fault.active(time_s) || fault.channel.value_or(channel) != channel)
            continue;
        return fault.kind == FaultKind::open ? SensorState::open : SensorState::shorted;
    }
    return SensorState::healthy;
}

std::optional<Fault> line_fault(const std::vector<Fault>& faults, std::uint8_t unit, double time_s) {
    for (const Fault& fault : faults) {
        if (fault.on_sensor() || !fault.active(time_s) || fault.unit.value_or(unit) != unit) continue;
        return fault;
    }
    return std::nullopt;
}

std::vector<Delivery> deliveries(Framing framing, const ModbusRequest& request, const Bytes& pdu,
                                 const std::optional<Fault>& fault) {
    const auto plain = [&] { return frame(framing, request.transaction, request.unit, pdu); };
    if (!fault) return {{.delay_s = 0.0, .bytes = plain()}};
    switch (fault->kind) {
        case FaultKind::open:
        case FaultKind::shorted:
            break;
        case FaultKind::silence:
            return {};
        case FaultKind::exception: {
            const Bytes refused = {static_cast<std::uint8_t>(request.pdu.front() | 0x80U),
                                   static_cast<std::uint8_t>(fault->value)};
            return {{.delay_s = 0.0, .bytes = frame(framing, request.transaction, request.unit, refused)}};
        }
        case FaultKind::late:
            return {{.delay_s = fault->value, .bytes = plain()}};
        case FaultKind::hang_up:
            if (framing == Framing::rtu) return {};
            return {{.delay_s = 0.0, .bytes = {}, .hang_up = true}};
        case FaultKind::truncated: {
            Bytes bytes = plain();
            bytes.resize(bytes.size() - std::min<std::size_t>(3, bytes.size() - 1));
            return {{.delay_s = 0.0, .bytes = std::move(bytes)}};
        }
        case FaultKind::wrong_crc: {
            Bytes bytes = plain();
            if (framing == Framing::rtu) bytes.back() ^= 0x5AU;
            return {{.delay_s = 0.0, .bytes = std::move(bytes)}};
        }
        case FaultKind::wrong_transaction: {
            const auto other = static_cast<std::uint16_t>(request.transaction + 1);
            return {{.delay_s = 0.0, .bytes = frame(framing, other, request.unit, pdu)}};
        }
        case FaultKind::wrong_unit: {
            const auto other = static_cast<std::uint8_t>(request.unit + 1);
            return {{.delay_s = 0.0, .bytes = frame(framing, request.transaction, other, pdu)}};
        }
    }
    return {{.delay_s = 0.0, .bytes = plain()}};
}

}  // namespace thermbal
