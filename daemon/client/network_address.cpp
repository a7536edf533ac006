#include "network_address.hpp"

#include <fmt/format.h>

namespace thermbal {

Result<LinkOptions> network_link(const std::string& where, Transport transport, int port_if_none) {
    LinkOptions link;
    link.transport = transport;
    link.port = port_if_none;
    const std::size_t colon = where.rfind(':');
    const bool is_ipv6 = colon != std::string::npos && where.find(':') != colon && where.front() != '[';
    link.host = where;
    if (colon != std::string::npos && !is_ipv6 && where.back() != ']') {
        link.host = where.substr(0, colon);
        const std::string port = where.substr(colon + 1);
        if (port.empty() || port.size() > 5 || port.find_first_not_of("0123456789") != std::string::npos)
            return fail(NextStep::refuse_input, fmt::format("\"{}\": accepted: HOST or HOST:PORT", where));
        link.port = std::stoi(port);
    }
    if (link.host.size() > 2 && link.host.front() == '[')
        link.host = link.host.substr(1, link.host.size() - 2);
    return link;
}

}  // namespace thermbal
