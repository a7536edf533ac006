#include "access.hpp"

#include <algorithm>
#include <filesystem>

#include <arpa/inet.h>
#include <fmt/format.h>

#include "address.hpp"
#include "files.hpp"

namespace thermbal {
namespace {

std::string lower(std::string_view text) {
    std::string made(text);
    std::ranges::transform(made, made.begin(),
                           [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
    return made;
}

bool is_address(const std::string& host) {
    in6_addr bytes{};
    return inet_pton(AF_INET, host.c_str(), &bytes) == 1 || inet_pton(AF_INET6, host.c_str(), &bytes) == 1;
}

}  // namespace

bool ListenAddress::is_loopback() const {
    return host == "localhost" || host == "::1" || (is_address(host) && host.starts_with("127."));
}

Result<ListenAddress> parse_listen_address(std::string_view text) {
    const auto wrong = [&] {
        return fail(
            NextStep::refuse_input,
            fmt::format("--listen {}: expected ADDRESS:PORT, e.g. 127.0.0.1:8087 or [::1]:8087", text));
    };
    const auto address = network_address(text);
    if (!address || !address->port || (address->host != "localhost" && !is_address(address->host)))
        return wrong();
    return ListenAddress{address->host, *address->port};
}

bool PageAccess::allows_host(std::string_view host_header) const {
    const auto asked = network_address(host_header);
    return asked && std::ranges::find(hosts, lower(asked->host)) != hosts.end();
}

bool PageAccess::allows_token(std::string_view given) const {
    unsigned differs = given.size() == token.size() ? 0 : 1;
    for (std::size_t i = 0; i < token.size(); ++i)
        differs |= static_cast<unsigned char>(token[i] ^ (i < given.size() ? given[i] : 0));
    return differs == 0;
}

PageAccess access_for(const ListenAddress& address, std::vector<std::string> other_hosts, std::string token) {
    PageAccess access{{address.host}, std::move(token)};
    if (address.is_loopback()) access.hosts.insert(access.hosts.end(), {"localhost", "127.0.0.1", "::1"});
    for (const std::string& host : other_hosts) access.hosts.push_back(lower(host));
    return access;
}

Result<std::string> read_token(const std::string& path) {
    const auto text = read_file(path);
    if (!text) return std::unexpected(text.error());
    std::error_code trouble;
    const auto rights = std::filesystem::status(path, trouble).permissions();
    if ((rights & std::filesystem::perms::others_read) != std::filesystem::perms::none)
        return fail(NextStep::refuse_input, fmt::format("{}: everybody can read it; chmod 600 it", path));
    constexpr std::size_t fewest = 16;
    std::string token = text->substr(0, text->find('\n'));
    const bool plain = std::ranges::all_of(token, [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
               c == '_';
    });
    if (token.size() < fewest || !plain)
        return fail(
            NextStep::refuse_input,
            fmt::format(
                "{}: expected a line of at least {} letters, digits, - or _; e.g. from openssl rand -hex 16",
                path, fewest));
    return token;
}

}  // namespace thermbal
