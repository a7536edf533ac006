#include "simulator/endpoints.hpp"

#include <cerrno>
#include <cstdlib>
#include <system_error>

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

namespace thermbal {
namespace {

constexpr int backlog = 16;
constexpr int tries_for_a_common_port = 20;

std::string reason(int error) {
    return std::generic_category().message(error);
}

/// Bound and listening; the error is an errno.
std::expected<UniqueFd, int> listen_at(const sockaddr* address, socklen_t size) {
    UniqueFd fd(socket(address->sa_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (!fd.valid()) return std::unexpected(errno);
    const int on = 1;
    setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (address->sa_family == AF_INET6) setsockopt(fd.get(), IPPROTO_IPV6, IPV6_V6ONLY, &on, sizeof on);
    if (bind(fd.get(), address, size) != 0 || listen(fd.get(), backlog) != 0) return std::unexpected(errno);
    return fd;
}

std::expected<UniqueFd, int> listen_v4(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return listen_at(reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

std::expected<UniqueFd, int> listen_v6(std::uint16_t port) {
    sockaddr_in6 address{};
    address.sin6_family = AF_INET6;
    address.sin6_port = htons(port);
    address.sin6_addr = in6addr_loopback;
    return listen_at(reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

std::uint16_t port_of(const UniqueFd& fd) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size);
    return ntohs(address.sin_port);
}

bool machine_lacks_v6(int error) {
    return error == EAFNOSUPPORT || error == EADDRNOTAVAIL;
}

void make_raw(int fd) {
    termios settings{};
    if (tcgetattr(fd, &settings) != 0) return;
    cfmakeraw(&settings);
    tcsetattr(fd, TCSANOW, &settings);
}

}  // namespace

Result<TcpEndpoint> listen_on_loopback(std::uint16_t port) {
    int error = 0;
    for (int attempt = 0; attempt < tries_for_a_common_port; ++attempt) {
        auto v4 = listen_v4(port);
        if (!v4) {
            error = v4.error();
            break;
        }
        TcpEndpoint endpoint;
        endpoint.port = port_of(*v4);
        endpoint.addresses.push_back(fmt::format("127.0.0.1:{}", endpoint.port));
        endpoint.listeners.push_back(std::move(*v4));
        auto v6 = listen_v6(endpoint.port);
        if (v6) {
            endpoint.addresses.push_back(fmt::format("[::1]:{}", endpoint.port));
            endpoint.listeners.push_back(std::move(*v6));
        } else if (!machine_lacks_v6(v6.error())) {
            error = v6.error();
            if (port == 0) continue;  // free on one of the two only: another free one
            break;
        }
        return endpoint;
    }
    return fail(NextStep::stop,
                fmt::format("port {}: cannot listen on loopback ({}); choose another --port, or 0 for a "
                            "free one",
                            port, reason(error)));
}

Result<PtyEndpoint> open_pty() {
    const auto failed = [](std::string_view step) {
        return fail(NextStep::stop, fmt::format("pseudo-terminal: {} failed ({})", step, reason(errno)));
    };
    PtyEndpoint pty;
    pty.master = UniqueFd(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK));
    if (!pty.master.valid()) return failed("posix_openpt");
    if (grantpt(pty.master.get()) != 0) return failed("grantpt");
    if (unlockpt(pty.master.get()) != 0) return failed("unlockpt");
    char path[128] = {};
    if (ptsname_r(pty.master.get(), path, sizeof path) != 0) return failed("ptsname_r");
    pty.path = path;
    pty.slave = UniqueFd(open(path, O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK));
    if (!pty.slave.valid()) return failed("opening it");
    make_raw(pty.slave.get());
    return pty;
}

void release_exclusive(const PtyEndpoint& pty) {
    ioctl(pty.slave.get(), TIOCNXCL);
}

Result<PortLink> PortLink::create(const std::string& target, const std::string& path) {
    struct stat existing{};
    if (lstat(path.c_str(), &existing) == 0) {
        if (!S_ISLNK(existing.st_mode)) {
            return fail(
                NextStep::refuse_input,
                fmt::format("--link {}: is there and is no symbolic link; name a path that is free", path));
        }
        unlink(path.c_str());
    }
    if (symlink(target.c_str(), path.c_str()) != 0) {
        return fail(
            NextStep::refuse_input,
            fmt::format("--link {}: cannot be created ({}); name a path in a folder that you may write to",
                        path, reason(errno)));
    }
    return PortLink(path);
}

Result<PtyLine> open_pty_line(const std::string& link_path) {
    auto port = open_pty();
    if (!port) return std::unexpected(port.error());
    PtyLine line{.port = std::move(*port)};
    if (link_path.empty()) return line;
    auto link = PortLink::create(line.port.path, link_path);
    if (!link) return std::unexpected(link.error());
    line.link.emplace(std::move(*link));
    return line;
}

PortLink::~PortLink() {
    if (!path_.empty()) unlink(path_.c_str());
}

}  // namespace thermbal
