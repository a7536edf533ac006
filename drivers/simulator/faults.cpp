#include "simulator/faults.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace thermbal {
namespace {

constexpr std::string_view shape =
    "KIND[=VALUE][:TARGET][@FROM_S[-TO_S]], e.g. open:T7@3600 or exception=4:2@600-900";

std::unexpected<Error> refuse(std::string_view text, std::string_view what) {
    return fail(NextStep::refuse_input, fmt::format("fault '{}': {}; write {}", text, what, shape));
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

/// Read again it is the same number. Without an exponent, whose sign would part two times.
std::string written(double seconds) {
    std::array<char, 400> digits{};
    const auto put =
        std::to_chars(digits.data(), digits.data() + digits.size(), seconds, std::chars_format::fixed);
    return {digits.data(), put.ptr};
}

/// Decimal, or hexadecimal after 0x.
std::optional<double> value_number(std::string_view text) {
    if (!text.starts_with("0x")) return number<double>(text);
    std::uint32_t bits = 0;
    const auto [end, error] = std::from_chars(text.data() + 2, text.data() + text.size(), bits, 16);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return bits;
}

/// Cuts `text` at the first `mark`; the part behind it is nothing when there is no mark.
std::pair<std::string_view, std::optional<std::string_view>> cut(std::string_view text, char mark) {
    const std::size_t at = text.find(mark);
    if (at == std::string_view::npos) return {text, std::nullopt};
    return {text.substr(0, at), text.substr(at + 1)};
}

std::string known_names() {
    std::string names;
    for (const FaultEntry& entry : fault_catalogue()) {
        names += fmt::format("{}{}", names.empty() ? "" : ", ", entry.name);
    }
    return names;
}

Result<double> read_value(const FaultEntry& entry, std::optional<std::string_view> text,
                          std::string_view whole_text) {
    const FaultValue& value = entry.value;
    if (!text) {
        if (value.required) return refuse(whole_text, fmt::format("{} needs a VALUE", entry.name));
        return value.usual;
    }
    if (value.name.empty()) return refuse(whole_text, fmt::format("{} takes no VALUE", entry.name));
    const auto read = value_number(*text);
    const bool fits =
        read && *read >= value.least && *read <= value.most && (!value.whole || *read == std::floor(*read));
    if (!fits) {
        return refuse(whole_text,
                      fmt::format("VALUE is a {} from {} to {}", value.whole ? "whole number" : "number",
                                  value.least, value.most));
    }
    return *read;
}

Result<void> read_target(Fault& fault, std::string_view target, std::string_view text) {
    switch (fault.place()) {
        case FaultPlace::sensor: {
            const auto index = target.starts_with('T') ? number<std::size_t>(target.substr(1)) : std::nullopt;
            if (!index || *index < 1 || *index > 16) return refuse(text, "a sensor fault acts on T1 ... T16");
            fault.channel = *index - 1;
            return {};
        }
        case FaultPlace::endpoint:
            return refuse(text, "a fault of the socket or port itself takes no TARGET");
        case FaultPlace::module:
        case FaultPlace::reply:
            break;
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

Result<Fault> read_kind(std::string_view what, std::string_view text) {
    const auto [kind_and_value, target] = cut(what, ':');
    const auto [kind_name, value_text] = cut(kind_and_value, '=');
    const FaultEntry* entry = find_fault(kind_name);
    if (entry == nullptr) return refuse(text, fmt::format("'{}' is none of {}", kind_name, known_names()));
    const auto value = read_value(*entry, value_text, text);
    if (!value) return std::unexpected(value.error());
    Fault fault{.kind = entry->kind, .value = *value};
    if (target) {
        if (auto read = read_target(fault, *target, text); !read) return std::unexpected(read.error());
    }
    return fault;
}

/// The bits that a number has in the registers; negative numbers in two's complement.
std::uint32_t bits_of(double value) {
    return value < 0.0 ? static_cast<std::uint32_t>(static_cast<std::int32_t>(value))
                       : static_cast<std::uint32_t>(value);
}

SensorState state_of(const Fault& fault) {
    if (fault.kind == FaultKind::open) return SensorState::open;
    if (fault.kind == FaultKind::shorted) return SensorState::shorted;
    return SensorState::coded(bits_of(fault.value));
}

}  // namespace

Result<Fault> parse_fault_kind(std::string_view text) {
    return read_kind(text, text);
}

Result<Fault> parse_fault(std::string_view text) {
    const auto [what, times] = cut(text, '@');
    if (!times) return refuse(text, "it has no @FROM_S");
    auto fault = read_kind(what, text);
    if (!fault) return fault;
    if (auto read = read_times(*fault, *times, text); !read) return std::unexpected(read.error());
    return fault;
}

std::string to_string(const Fault& fault) {
    const FaultEntry& entry = entry_of(fault.kind);
    std::string text(entry.name);
    if (!entry.value.name.empty()) text += fmt::format("={}", fault.value);
    if (fault.channel) text += fmt::format(":T{}", *fault.channel + 1);
    if (fault.unit) text += fmt::format(":{}", *fault.unit);
    text += "@" + written(fault.from_s);
    if (std::isfinite(fault.to_s)) text += "-" + written(fault.to_s);
    return text;
}

Result<void> check_reach(const Fault& fault, const FaultReach& reach) {
    const FaultFraming wanted = entry_of(fault.kind).framing;
    std::string what;
    if (wanted != FaultFraming::any && reach.framing != FaultFraming::any && wanted != reach.framing) {
        what = wanted == FaultFraming::tcp ? "exists on TCP only; take it out, or serve without --rtu"
                                           : "exists on RTU only; take it out, or serve with --rtu";
    } else if (fault.unit && !reach.units.empty() &&
               std::ranges::find(reach.units, *fault.unit) == reach.units.end()) {
        what = fmt::format("no such unit; there are: {}", fmt::join(reach.units, ", "));
    } else if (fault.channel && *fault.channel >= reach.channels) {
        what = fmt::format("no such channel; there are: T1 ... T{}", reach.channels);
    } else {
        return {};
    }
    return fail(NextStep::refuse_input, fmt::format("fault '{}': {}", to_string(fault), what));
}

std::size_t FaultPlan::clear(FaultKind kind) {
    return std::erase_if(faults_, [kind](const Fault& fault) { return fault.kind == kind; });
}

SensorState FaultPlan::sensor_state(std::size_t channel, double time_s) const {
    for (const Fault& fault : faults_) {
        if (fault.place() != FaultPlace::sensor || !fault.active(time_s)) continue;
        if (fault.channel.value_or(channel) == channel) return state_of(fault);
    }
    return SensorState::healthy;
}

bool FaultPlan::frozen(std::uint8_t unit, double time_s) const {
    return std::ranges::any_of(faults_, [&](const Fault& fault) {
        return fault.kind == FaultKind::frozen && fault.active(time_s) && fault.unit.value_or(unit) == unit;
    });
}

std::optional<Fault> FaultPlan::on_reply(std::uint8_t unit, double time_s) const {
    for (const Fault& fault : faults_) {
        if (fault.place() != FaultPlace::reply || !fault.active(time_s)) continue;
        if (fault.unit.value_or(unit) == unit) return fault;
    }
    return std::nullopt;
}

EndpointState FaultPlan::endpoint(double time_s) const {
    EndpointState state;
    for (const Fault& fault : faults_) {
        if (!fault.active(time_s)) continue;
        if (fault.kind == FaultKind::refuse) state.refuses = true;
        if (fault.kind == FaultKind::half_open) state.half_open = true;
        if (fault.kind == FaultKind::unplug) state.unplugged = true;
        if (fault.kind == FaultKind::one_client) state.one_client_hold_s = fault.value;
    }
    return state;
}

bool FaultPlan::watches_endpoint() const {
    return std::ranges::any_of(faults_, [](const Fault& f) { return f.place() == FaultPlace::endpoint; });
}

}  // namespace thermbal
