#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <vector>

#include "base/error.hpp"
#include "simulator/connection.hpp"
#include "simulator/endpoints.hpp"
#include "simulator/faults.hpp"

namespace thermbal {

/// What is wrong with the socket or port itself at a moment of CLOCK_MONOTONIC.
using EndpointStateAt = std::function<EndpointState(std::int64_t now_ns)>;

/// Modbus over several connections at once in one poll loop, one thread.
class Server {
  public:
    explicit Server(ServeRequest serve, ServerLimits limits = {})
        : serve_(std::move(serve)), limits_(limits) {}

    void listen(TcpEndpoint endpoint);
    /// `plug_in` is called at once, and again whenever the port comes back.
    Result<void> attach(std::function<Result<PtyLine>()> plug_in);
    /// Asked before every look at the sockets, at least every `look_again_ms`.
    void watch_endpoint(EndpointStateAt state, int look_again_ms);
    /// Calls `on_readable` when `fd` is.
    void watch(int fd, std::function<void()> on_readable);

    /// Runs until `stop_fd` becomes readable. Error (stop) when poll itself fails, or a port cannot be
    /// opened again.
    Result<void> run(int stop_fd);

    /// Whether anything that was asked for has not gone out yet. On the thread of `run`.
    bool busy() const;

  private:
    struct Watched {
        int fd = -1;
        std::function<void()> on_readable;
    };

    Result<void> apply(const EndpointState& state);
    Result<void> apply_to_listeners(const EndpointState& state);
    Result<void> apply_to_port(const EndpointState& state);
    Result<void> plug_in();
    void accept_from(int listener, std::int64_t now_ns);
    bool has_a_place(std::int64_t now_ns) const;
    void serve_connections(const std::vector<short>& readiness);
    int wait_ms(std::int64_t now_ns) const;

    ServeRequest serve_;
    ServerLimits limits_;
    EndpointStateAt state_at_ = [](std::int64_t) { return EndpointState{}; };
    EndpointState state_;
    int look_again_ms_ = 1000;
    std::uint16_t port_ = 0;
    TcpEndpoint tcp_;
    std::function<Result<PtyLine>()> open_port_;
    std::unique_ptr<PtyLine> pty_;
    std::optional<UniqueFd> old_port_;  ///< keeps the name of the unplugged port from being given again
    std::list<Connection> connections_;
    std::int64_t place_free_ns_ = 0;  ///< one client only: when the place of the last one is free
    std::vector<Watched> watched_;
};

}  // namespace thermbal
