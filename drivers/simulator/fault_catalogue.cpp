#include "simulator/fault_catalogue.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace thermbal {
namespace {

constexpr FaultValue none{};
constexpr double longest_delay_s = 3600.0;

constexpr FaultValue delay_s(double usual_s) {
    return {.name = "S", .usual = usual_s, .least = 0.0, .most = longest_delay_s};
}

using enum FaultPlace;
using enum FaultFraming;

constexpr std::array<FaultEntry, 24> catalogue = {{
    {FaultKind::open, "open", sensor, any, none, "the module's code for a broken lead"},
    {FaultKind::shorted, "short", sensor, any, none, "the module's code for a short"},
    {FaultKind::code,
     "code",
     sensor,
     any,
     {.name = "N", .least = -2147483648.0, .most = 4294967295.0, .whole = true, .required = true},
     "this number in the registers, e.g. any fault code of a profile: code=0x7FFF, code=-30000"},
    {FaultKind::frozen, "frozen", module, any, none, "the values of the last read before, again and again"},
    {FaultKind::silence, "silence", reply, any, none, "no reply"},
    {FaultKind::late, "late", reply, any, delay_s(1.0), "the reply comes S real seconds late"},
    {FaultKind::truncated, "truncated", reply, any, none, "the last 3 bytes are missing"},
    {FaultKind::trickle, "trickle", reply, any, delay_s(0.05), "byte by byte, S real seconds apart"},
    {FaultKind::duplicate, "duplicate", reply, any, delay_s(0.0), "the reply twice, the second S later"},
    {FaultKind::wrong_crc, "wrong-crc", reply, rtu, none, "a CRC that does not fit"},
    {FaultKind::wrong_transaction, "wrong-tid", reply, tcp, none, "the transaction id of another request"},
    {FaultKind::wrong_unit, "wrong-unit", reply, any, none, "the reply of another unit"},
    {FaultKind::wrong_function, "wrong-function", reply, any, none, "the reply to another function"},
    {FaultKind::wrong_length, "wrong-length", reply, any, none, "sound, but one register less than asked"},
    {FaultKind::wrong_count, "wrong-count", reply, any, none, "its byte count says 2 more than there are"},
    {FaultKind::echo, "echo", reply, any, none, "the request comes back in front of the reply"},
    {FaultKind::unsolicited, "unsolicited", reply, any, delay_s(0.05),
     "S after the reply a sound one that nobody asked for, with other temperatures"},
    {FaultKind::noise,
     "noise",
     reply,
     any,
     {.name = "N", .usual = 12.0, .least = 1.0, .most = 1000.0, .whole = true},
     "N random bytes in front of the reply"},
    {FaultKind::exception,
     "exception",
     reply,
     any,
     {.name = "N", .usual = 4.0, .least = 1.0, .most = 255.0, .whole = true},
     "exception N instead of the reply"},
    {FaultKind::hang_up, "hangup", reply, any, none, "TCP: the connection is closed; RTU: no reply"},
    {FaultKind::refuse, "refuse", endpoint, tcp, none, "connections are closed and further ones refused"},
    {FaultKind::half_open, "half-open", endpoint, any, none,
     "nothing is read and nobody is answered; connections are accepted"},
    {FaultKind::one_client, "one-client", endpoint, tcp, delay_s(0.0),
     "one connection at a time; its place is free again S real seconds after its end"},
    {FaultKind::unplug, "unplug", endpoint, rtu, none,
     "the port is gone; it comes back under another name, --link points to it"},
}};

std::string_view target_of(FaultPlace place) {
    switch (place) {
        case FaultPlace::sensor:
            return "channel";
        case FaultPlace::module:
        case FaultPlace::reply:
            return "unit";
        case FaultPlace::endpoint:
            return "";
    }
    return "";
}

std::string_view framing_of(FaultFraming framing) {
    if (framing == FaultFraming::any) return "";
    return framing == FaultFraming::tcp ? "TCP only: " : "RTU only: ";
}

}  // namespace

std::span<const FaultEntry> fault_catalogue() {
    return catalogue;
}

const FaultEntry& entry_of(FaultKind kind) {
    return *std::ranges::find(catalogue, kind, &FaultEntry::kind);
}

const FaultEntry* find_fault(std::string_view name) {
    const auto found = std::ranges::find(catalogue, name, &FaultEntry::name);
    return found == catalogue.end() ? nullptr : &*found;
}

std::string fault_help() {
    std::string text;
    for (const FaultEntry& entry : catalogue) {
        const std::string written = entry.value.name.empty()
                                        ? std::string(entry.name)
                                        : fmt::format("{}={}", entry.name, entry.value.name);
        text += fmt::format("  {:16} {:8} {}{}\n", written, target_of(entry.place), framing_of(entry.framing),
                            entry.what);
    }
    return text;
}

}  // namespace thermbal
