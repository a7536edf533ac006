#pragma once

#include <chrono>
#include <deque>
#include <expected>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/error.hpp"

namespace thermbal {

struct Notification {
    std::string topic;
    nlohmann::json params;
};

/// One connection to a running thermbald: JSON-RPC 2.0, one document a line. One thread.
///
/// Errors: reopen_link when nobody is there, the connection broke, or no answer came in time (the connection
/// is not to be used any more); retry when the daemon says "not now"; otherwise the daemon refused, in its
/// own words.
class SocketClient {
  public:
    static Result<SocketClient> connect(const std::string& path);

    /// Sends a request and waits for its answer. Notifications that come meanwhile are kept for next().
    Result<nlohmann::json> ask(const std::string& method,
                               const nlohmann::json& params = nlohmann::json::object(),
                               std::chrono::milliseconds limit = std::chrono::seconds(10));

    Result<void> subscribe(const std::vector<std::string>& topics);

    /// The oldest notification not yet taken; nullopt when none came within `limit`.
    Result<std::optional<Notification>> next(std::chrono::milliseconds limit);

    /// Readable when there may be something for next(0); what is kept already does not make it readable.
    int fd() const { return fd_; }
    std::size_t kept() const { return kept_.size(); }

    SocketClient(SocketClient&& other) noexcept;
    SocketClient& operator=(SocketClient&& other) noexcept;
    ~SocketClient();

  private:
    using Deadline = std::chrono::steady_clock::time_point;
    SocketClient(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}

    Result<void> send_line(std::string line, Deadline deadline) const;
    /// One line, or nullopt at the deadline.
    Result<std::optional<std::string>> read_line(Deadline deadline);
    /// A line as JSON; what is no JSON-RPC breaks the connection.
    Result<nlohmann::json> parsed(const std::string& line) const;
    std::unexpected<Error> broken(std::string_view why) const;

    int fd_ = -1;
    std::string path_;
    std::string unread_;
    std::size_t searched_ = 0;  ///< of unread_, without a line's end
    std::deque<Notification> kept_;
    int last_id_ = 0;
};

}  // namespace thermbal
