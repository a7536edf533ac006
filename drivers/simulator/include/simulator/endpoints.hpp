#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "simulator/unique_fd.hpp"

namespace thermbal {

/// Listening sockets on the loopback addresses, one port for all.
struct TcpEndpoint {
    std::vector<UniqueFd> listeners;
    std::vector<std::string> addresses;  ///< as printed: 127.0.0.1:15020, [::1]:15020
    std::uint16_t port = 0;
};

/// Listens on 127.0.0.1 and, where the machine has it, on ::1. `port` 0 picks a free one. Only loopback: a
/// module that takes writes from anybody has no business on a network. Error (stop) when the port is taken.
Result<TcpEndpoint> listen_on_loopback(std::uint16_t port);

/// A pseudo-terminal in raw mode: the simulator's end, and the path that a Modbus master opens.
struct PtyEndpoint {
    UniqueFd master;
    /// Kept open, so that the line survives its clients.
    UniqueFd slave;
    std::string path;
};

Result<PtyEndpoint> open_pty();

/// A pseudo-terminal that outlives a client killed with TIOCEXCL set would stay closed to the next one; a
/// real port does not. Takes that mark off.
void release_exclusive(const PtyEndpoint& pty);

/// A symbolic link to the pseudo-terminal, removed again with the object. A link at that place is replaced,
/// any other file is refused (refuse_input).
class PortLink {
  public:
    static Result<PortLink> create(const std::string& target, const std::string& path);
    PortLink(PortLink&& other) noexcept : path_(std::exchange(other.path_, {})) {}
    PortLink& operator=(PortLink&&) = delete;
    PortLink(const PortLink&) = delete;
    PortLink& operator=(const PortLink&) = delete;
    ~PortLink();

  private:
    explicit PortLink(std::string path) : path_(std::move(path)) {}
    std::string path_;
};

/// A pseudo-terminal and the link that points to it.
struct PtyLine {
    PtyEndpoint port;
    std::optional<PortLink> link = {};
};

/// open_pty, and PortLink::create where `link_path` is not empty.
Result<PtyLine> open_pty_line(const std::string& link_path);

}  // namespace thermbal
