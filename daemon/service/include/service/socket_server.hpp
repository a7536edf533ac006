#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>
#include <sys/types.h>

#include "base/error.hpp"

namespace thermbal {

/// Who is at the other end, from the kernel (SO_PEERCRED).
struct Peer {
    pid_t pid = 0;
    uid_t uid = 0;
    gid_t gid = 0;
};

struct Request {
    std::string method;
    nlohmann::json params;  ///< an object; `{}` when the request had none
    Peer peer;
};

/// Answers a request at once, on the thread of `dispatch`. An error becomes a JSON-RPC error: refuse_input
/// -32602, retry -32003, any other -32000, each with the message.
using Handler = std::function<Result<nlohmann::json>(const Request&)>;

/// Whether a method only reads, or changes something and is for operators.
enum class Access : std::uint8_t { reads, changes };

struct SocketServerOptions {
    std::filesystem::path path = "/run/thermbal/thermbald.sock";
    mode_t mode = 0666;           ///< who can open it may read; what changes something is checked per request
    std::string operators_group;  ///< whose members may change something, as root and the daemon's user may
    std::size_t max_clients = 64;
    std::size_t max_clients_per_user = 24;  ///< root and the daemon's own user are exempt
    std::size_t max_request_bytes = 65536;  ///< one line; a longer one is answered with an error and closed
    /// Of one client; further ones wait in its socket. Refilled in steps of 50 ms, so that so many may come
    /// at once.
    std::size_t max_requests_per_50_ms = 50;
    std::size_t max_reply_bytes = 8UL * 1024 * 1024;
    std::size_t max_pending_bytes = 64UL * 1024 * 1024;  ///< unread replies of all clients together
    /// Unread notifications at which a subscriber is dropped when the next one comes. One alone may be
    /// longer: the predictions of 1024 channels are some megabytes.
    std::size_t max_backlog_bytes = 1024UL * 1024;
};

/// JSON-RPC 2.0 over a Unix stream socket, one document a line. Requests may be pipelined; replies come in
/// their order; a request without id gets none; batches are refused (-32600). Params are named (an object).
/// `subscribe` is built in: {"topics": ["scan", "event"]}, all topics without it; a topic that
/// is none is refused; `unsubscribe` ends it.
///
/// One thread. Nothing here waits: it hangs on an event loop by `fd` (readable: call `dispatch`).
class SocketServer {
  public:
    /// Takes the socket that systemd passed (sd_listen_fds), or binds `path`. A socket file that nobody
    /// answers on is removed; one that answers is refused. Looks up the operators' group, once: only this
    /// call may wait for a name service.
    static Result<SocketServer> open(const SocketServerOptions& options);

    /// REQUIRES: before the first dispatch; a name once.
    void add_method(std::string name, Access access, Handler handler);
    /// What may be subscribed to and is published. REQUIRES: before the first dispatch.
    void add_topics(std::set<std::string, std::less<>> topics);

    int fd() const;
    /// Serves what is ready, then returns. Handlers may call publish.
    void dispatch();

    /// Sends {"jsonrpc":"2.0","method":topic,"params":params} to the subscribers of the topic. A subscriber
    /// whose backlog is full is dropped.
    void publish(std::string_view topic, const nlohmann::json& params);

    struct Counters {
        std::uint64_t clients = 0;  ///< connected now
        std::uint64_t subscribers = 0;
        std::uint64_t accepted = 0;
        std::uint64_t refused = 0;  ///< too many clients
        std::uint64_t dropped = 0;  ///< too slow, or a line too long
        std::uint64_t requests = 0;
        std::uint64_t denied = 0;
    };
    Counters counters() const;

    SocketServer(SocketServer&&) noexcept;
    SocketServer& operator=(SocketServer&&) noexcept;
    ~SocketServer();

  private:
    struct Parts;
    explicit SocketServer(std::unique_ptr<Parts> parts);
    std::unique_ptr<Parts> parts_;
};

}  // namespace thermbal
