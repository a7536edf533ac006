#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"

namespace thermbal {

struct ListenAddress {
    std::string host;  ///< an IP address without brackets, or "localhost"
    int port = 0;      ///< 0: a free one

    bool is_loopback() const;
};

/// "127.0.0.1:8087", "[::1]:8087", "localhost:0". Errors (refuse_input) say what was found and accepted.
Result<ListenAddress> parse_listen_address(std::string_view text);

/// Who may ask. A web page that a person has open elsewhere can send requests to this machine: it cannot
/// choose the Host header, so a name that is not this server's is refused (DNS rebinding), and without the
/// token nothing is answered where one is set.
struct PageAccess {
    std::vector<std::string> hosts;  ///< names and addresses, without port, that a Host header may have
    std::string token;               ///< empty: none is asked for

    bool allows_host(std::string_view host_header) const;
    /// In constant time.
    bool allows_token(std::string_view given) const;
};

/// The hosts that go with an address to listen on, and those that a person names beside it.
PageAccess access_for(const ListenAddress& address, std::vector<std::string> other_hosts, std::string token);

/// The token in a file: its first line. Errors (refuse_input): not readable, readable by everybody, shorter
/// than 16 characters or with others than letters, digits, '-', '_'.
Result<std::string> read_token(const std::string& path);

}  // namespace thermbal
