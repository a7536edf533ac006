#include "network_address.hpp"

#include <utility>

#include <fmt/format.h>

#include "address.hpp"

namespace thermbal {

Result<LinkOptions> network_link(const std::string& where, Transport transport, int port_if_none) {
    auto address = network_address(where);
    if (!address)
        return fail(NextStep::refuse_input, fmt::format("\"{}\": accepted: HOST or HOST:PORT", where));
    LinkOptions link;
    link.transport = transport;
    link.host = std::move(address->host);
    link.port = address->port.value_or(port_if_none);
    return link;
}

}  // namespace thermbal
