#include "address.hpp"

#include <charconv>
#include <utility>

namespace thermbal {
namespace {

std::optional<int> port_in(std::string_view text) {
    int port = 0;
    const auto [end, trouble] = std::from_chars(text.data(), text.data() + text.size(), port);
    const bool is_port =
        trouble == std::errc() && end == text.data() + text.size() && port >= 0 && port <= 65535;
    return is_port ? std::optional(port) : std::nullopt;
}

}  // namespace

std::optional<NetworkAddress> network_address(std::string_view text) {
    NetworkAddress address;
    std::string_view rest;
    if (text.starts_with('[')) {
        const std::size_t end = text.find(']');
        if (end == std::string_view::npos) return std::nullopt;
        address.host = text.substr(1, end - 1);
        rest = text.substr(end + 1);
    } else {
        const std::size_t colon = text.find(':');
        const bool has_port = colon != std::string_view::npos && text.rfind(':') == colon;
        address.host = text.substr(0, has_port ? colon : text.size());
        rest = text.substr(address.host.size());
    }
    if (address.host.empty()) return std::nullopt;
    if (rest.empty()) return address;
    address.port = rest.front() == ':' ? port_in(rest.substr(1)) : std::nullopt;
    return address.port ? std::optional(std::move(address)) : std::nullopt;
}

}  // namespace thermbal
