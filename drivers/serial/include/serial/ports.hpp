#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

/// A serial port of this machine. Empty or 0: the port does not say.
struct PortInfo {
    std::string path;         ///< /dev/ttyUSB0: changes with the order of plugging
    std::string by_id_path;   ///< /dev/serial/by-id/...: stays
    std::string description;  ///< for a person
    int usb_vid = 0;
    int usb_pid = 0;
    std::string serial;  ///< serial number of the USB adapter
};

/// Which port is meant. Every field that is set has to match; at least one has to be set.
struct PortSelector {
    std::optional<int> usb_vid;
    std::optional<int> usb_pid;
    std::string serial;
    std::string path;  ///< a device path or a by-id path
};

/// "1a86:7523" (hexadecimal, as lsusb prints it) into vid and pid of a selector.
Result<PortSelector> parse_vid_pid(std::string_view text);
std::string describe(const PortSelector& selector);
std::string describe(const PortInfo& port);

/// All serial ports that the system knows, sorted by path. None is an empty list. Blocks for some
/// milliseconds.
Result<std::vector<PortInfo>> list_ports();

/// The one port that the selector means. None or several: an error (reopen_link: it may be plugged in later)
/// that lists what is there.
Result<PortInfo> match_port(std::span<const PortInfo> ports, const PortSelector& selector);

/// list_ports and match_port: the device path to open now.
Result<std::string> find_port(const PortSelector& selector);

}  // namespace thermbal
