#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include "serial/ports.hpp"

namespace thermbal {
namespace {

std::optional<int> hex16(std::string_view text) {
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
    if (error != std::errc() || end != text.data() + text.size() || text.empty() || text.size() > 4 ||
        value < 0) {
        return std::nullopt;
    }
    return value;
}

bool matches(const PortInfo& port, const PortSelector& selector) {
    return (!selector.usb_vid || *selector.usb_vid == port.usb_vid) &&
           (!selector.usb_pid || *selector.usb_pid == port.usb_pid) &&
           (selector.serial.empty() || selector.serial == port.serial) &&
           (selector.path.empty() || selector.path == port.path || selector.path == port.by_id_path);
}

bool is_empty(const PortSelector& selector) {
    return !selector.usb_vid && !selector.usb_pid && selector.serial.empty() && selector.path.empty();
}

std::string list_of(std::span<const PortInfo> ports) {
    if (ports.empty()) return "there is no serial port";
    std::string text = "there is";
    for (std::size_t i = 0; i < ports.size(); ++i) {
        text += fmt::format("{} {}", i == 0 ? "" : ",", describe(ports[i]));
    }
    return text;
}

}  // namespace

Result<PortSelector> parse_vid_pid(std::string_view text) {
    const std::size_t colon = text.find(':');
    if (colon != std::string_view::npos) {
        const auto vid = hex16(text.substr(0, colon));
        const auto pid = hex16(text.substr(colon + 1));
        if (vid && pid) return PortSelector{.usb_vid = vid, .usb_pid = pid, .serial = {}, .path = {}};
    }
    return fail(
        NextStep::refuse_input,
        fmt::format("\"{}\" is not a USB VID:PID; four hexadecimal digits each, such as \"1a86:7523\"",
                    text));
}

std::string describe(const PortSelector& selector) {
    std::string text;
    const auto add = [&](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
    if (selector.usb_vid && selector.usb_pid)
        add(fmt::format("USB {:04x}:{:04x}", *selector.usb_vid, *selector.usb_pid));
    if (!selector.serial.empty()) add(fmt::format("serial number {}", selector.serial));
    if (!selector.path.empty()) add(selector.path);
    return text.empty() ? "no selector" : text;
}

std::string describe(const PortInfo& port) {
    std::string text = port.path;
    if (port.usb_vid != 0 || port.usb_pid != 0)
        text += fmt::format(" (USB {:04x}:{:04x}", port.usb_vid, port.usb_pid);
    else
        return text;
    if (!port.serial.empty()) text += fmt::format(", serial number {}", port.serial);
    return text + ")";
}

Result<PortInfo> match_port(std::span<const PortInfo> ports, const PortSelector& selector) {
    if (is_empty(selector)) {
        return fail(NextStep::refuse_input, "no port is selected; give VID:PID, a serial number or a path");
    }
    std::vector<PortInfo> found;
    std::ranges::copy_if(ports, std::back_inserter(found),
                         [&](const PortInfo& port) { return matches(port, selector); });
    if (found.size() == 1) return found.front();
    if (found.empty()) {
        return fail(NextStep::reopen_link,
                    fmt::format("no serial port is {}; {}", describe(selector), list_of(ports)));
    }
    return fail(NextStep::reopen_link,
                fmt::format("{} serial ports are {}: {}; add the serial number or the by-id path",
                            found.size(), describe(selector), list_of(found)));
}

Result<std::string> find_port(const PortSelector& selector) {
    const auto ports = list_ports();
    if (!ports) return std::unexpected(ports.error());
    const auto port = match_port(*ports, selector);
    if (!port) return std::unexpected(port.error());
    return port->path;
}

}  // namespace thermbal
