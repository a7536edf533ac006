#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "modbus/link.hpp"

namespace thermbal {
namespace {

bool in_range(double value, double low, double high) {
    return value >= low && value <= high;
}

std::string check_serial(const LinkOptions& options) {
    if (options.device.empty() && !options.find_device) return "device is empty; the path of a serial port";
    const std::vector<int>& bauds = known_baud_rates();
    if (std::ranges::find(bauds, options.baud) == bauds.end()) {
        return fmt::format("baud is {}; one of {}", options.baud, fmt::join(bauds, ", "));
    }
    if (options.parity != 'N' && options.parity != 'E' && options.parity != 'O') {
        return fmt::format("parity is '{}'; N, E or O", options.parity);
    }
    if (options.data_bits != 8)
        return fmt::format("data_bits is {}; 8: Modbus RTU knows no other", options.data_bits);
    if (options.stop_bits != 1 && options.stop_bits != 2) {
        return fmt::format("stop_bits is {}; 1 or 2", options.stop_bits);
    }
    return {};
}

/// One colon separates a port, which has a key of its own; an IPv6 address has two and more, a URL has a
/// slash.
bool may_be_host(const std::string& host) {
    const auto belongs = [](unsigned char c) {
        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' ||
               c == '-' || c == '_' || c == ':' || c == '%';
    };
    return !host.empty() && std::ranges::all_of(host, belongs) && std::ranges::count(host, ':') != 1;
}

std::string check_network(const LinkOptions& options) {
    if (!may_be_host(options.host)) {
        return fmt::format(
            "host is \"{}\"; a name or an IPv4 or IPv6 address, the port is a setting of its own",
            options.host);
    }
    if (options.port < 1 || options.port > 65535) return fmt::format("port is {}; 1 to 65535", options.port);
    return {};
}

}  // namespace

const std::vector<int>& known_baud_rates() {
    static const std::vector<int> rates{1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400};
    return rates;
}

std::string check_link_options(const LinkOptions& options) {
    std::string complaint =
        options.transport == Transport::rtu ? check_serial(options) : check_network(options);
    if (!complaint.empty()) return complaint;
    if (!in_range(options.response_timeout_s, 0.001, 60.0)) {
        return fmt::format("response_timeout_s is {}; 0.001 to 60", options.response_timeout_s);
    }
    if (!in_range(options.connect_timeout_s, 0.001, 60.0)) {
        return fmt::format("connect_timeout_s is {}; 0.001 to 60", options.connect_timeout_s);
    }
    if (!in_range(options.first_pause_s, 0.0, 60.0) ||
        !in_range(options.longest_pause_s, options.first_pause_s, 60.0)) {
        return fmt::format("the pause after a failed opening is {} to {} s; 0 to 60, the shorter one first",
                           options.first_pause_s, options.longest_pause_s);
    }
    if (!in_range(options.quiet_s, 0.0, 1.0)) return fmt::format("quiet_s is {}; 0 to 1", options.quiet_s);
    return {};
}

double longest_call_s(const LinkOptions& options) {
    // What the kernel and this process need besides: opening a device, a late wake-up on a busy machine.
    constexpr double slack_s = 0.1;
    const double connect_s = options.transport == Transport::rtu ? 0.0 : options.connect_timeout_s;
    if (options.transport == Transport::tcp) return connect_s + options.response_timeout_s + slack_s;
    const double settle_s = 2.0 * options.response_timeout_s + 2.0 * options.quiet_s;
    const double exchange_s = options.response_timeout_s + options.quiet_s;
    return connect_s + settle_s + 2.0 * exchange_s + slack_s;
}

}  // namespace thermbal
