#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "simulator/deliveries.hpp"
#include "simulator/frames.hpp"
#include "simulator/unique_fd.hpp"

namespace thermbal {

/// Answers one request that arrived at `now_ns` of CLOCK_MONOTONIC.
using ServeRequest =
    std::function<std::vector<Delivery>(Framing framing, const ModbusRequest& request, std::int64_t now_ns)>;

struct ServerLimits {
    std::size_t clients = 32;              ///< further connections are closed at once
    std::size_t unsent_bytes = 65536;      ///< who asks and does not read is closed
    std::size_t pending_replies = 512;     ///< requests beyond these stay unanswered
    std::int64_t silence_ns = 40'000'000;  ///< of an RTU line: at least 3.5 characters at 1200 baud
};

/// One client's stream of requests and replies, or a serial line. Knows bytes and time, and nothing of
/// registers. One thread; nothing waits.
class Connection {
  public:
    Connection(UniqueFd fd, Framing framing) : fd_(std::move(fd)), framing_(framing) {}

    int fd() const { return fd_.get(); }
    bool wants_to_write() const { return !unsent_.empty(); }
    /// Closed by either side, and nothing left to send: to be thrown away. A serial line never is.
    bool ended() const { return closing_ && framing_ == Framing::tcp && unsent_.empty(); }
    /// Something was asked for that has not gone out yet.
    bool busy() const { return !received_.empty() || !pending_.empty() || !unsent_.empty(); }

    void read(std::int64_t now_ns);
    /// Serves what has been read, sends what is due.
    void serve(const ServeRequest& answer, const ServerLimits& limits, std::int64_t now_ns);
    /// When something is due next, at the latest `until_ns`.
    std::int64_t next_due_ns(const ServerLimits& limits, std::int64_t until_ns) const;

  private:
    struct Pending {
        std::int64_t due_ns = 0;
        Delivery delivery;
    };

    void answer_received(const ServeRequest& answer, const ServerLimits& limits, std::int64_t now_ns);
    void send_due(std::int64_t now_ns);
    void flush(const ServerLimits& limits);
    /// Forgets all that is under way; TCP: and closes. A serial line stays.
    void drop();

    UniqueFd fd_;
    Framing framing_;
    Bytes received_;
    std::int64_t last_byte_ns_ = 0;
    std::vector<Pending> pending_;
    Bytes unsent_;
    bool closing_ = false;
};

}  // namespace thermbal
