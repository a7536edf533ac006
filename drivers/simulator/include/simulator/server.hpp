#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <vector>

#include "base/error.hpp"
#include "simulator/endpoints.hpp"
#include "simulator/faults.hpp"
#include "simulator/frames.hpp"

namespace thermbal {

/// Answers one request that arrived at `now_ns` of CLOCK_MONOTONIC.
using ServeRequest =
    std::function<std::vector<Delivery>(Framing framing, const ModbusRequest& request, std::int64_t now_ns)>;

struct ServerLimits {
    std::size_t clients = 32;              ///< further connections are closed at once
    std::size_t unsent_bytes = 65536;      ///< who asks and does not read is closed
    std::size_t pending_replies = 256;     ///< requests beyond these stay unanswered
    std::int64_t silence_ns = 40'000'000;  ///< of an RTU line: at least 3.5 characters at 1200 baud
};

/// Modbus over several connections at once in one poll loop, one thread. Knows bytes and time, and nothing of
/// registers.
class Server {
  public:
    Server(ServeRequest serve, ServerLimits limits) : serve_(std::move(serve)), limits_(limits) {}

    void listen(TcpEndpoint endpoint);
    void attach(PtyEndpoint pty);
    /// Runs until `stop_fd` becomes readable. Error (stop) when poll itself fails.
    Result<void> run(int stop_fd);

  private:
    struct Pending {
        std::int64_t due_ns = 0;
        Delivery delivery;
    };
    struct Connection {
        UniqueFd fd;
        Framing framing = Framing::tcp;
        Bytes received;
        std::int64_t last_byte_ns = 0;
        std::vector<Pending> pending;
        Bytes unsent;
        bool closing = false;
        std::size_t poll_slot = 0;
    };

    void accept_from(int listener);
    void read_from(Connection& connection, std::int64_t now_ns);
    void handle_received(Connection& connection, std::int64_t now_ns);
    void send_due(Connection& connection, std::int64_t now_ns);
    void flush(Connection& connection);
    /// Forgets all that is under way; TCP: and closes. A serial line stays.
    static void drop(Connection& connection);
    int wait_ms(std::int64_t now_ns) const;

    ServeRequest serve_;
    ServerLimits limits_;
    TcpEndpoint tcp_;
    std::optional<PtyEndpoint> pty_;
    std::list<Connection> connections_;
};

}  // namespace thermbal
