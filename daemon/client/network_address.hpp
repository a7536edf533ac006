#pragma once

#include <string>

#include "base/error.hpp"
#include "modbus/link.hpp"

namespace thermbal {

/// A line to HOST, HOST:PORT, [IPV6] or [IPV6]:PORT; `port_if_none` where no port is said. Error:
/// refuse_input, the port is none.
Result<LinkOptions> network_link(const std::string& where, Transport transport,
                                 int port_if_none = LinkOptions{}.port);

}  // namespace thermbal
