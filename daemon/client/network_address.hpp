#pragma once

#include <string>

#include "base/error.hpp"
#include "modbus/link.hpp"

namespace thermbal {

/// A line to HOST, HOST:PORT, [IPV6] or [IPV6]:PORT; without a port the one that the line has anyhow. Error:
/// refuse_input, the port is none.
Result<LinkOptions> network_link(const std::string& where, Transport transport);

}  // namespace thermbal
