#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace thermbal {

struct NetworkAddress {
    std::string host;         ///< without brackets
    std::optional<int> port;  ///< 0 to 65535
};

/// HOST, HOST:PORT, IPV6, [IPV6] or [IPV6]:PORT; nullopt for what is none of these. Whether the host is one,
/// nobody looks.
std::optional<NetworkAddress> network_address(std::string_view text);

}  // namespace thermbal
