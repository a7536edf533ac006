#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "socket_client.hpp"
#include "watch_frame.hpp"

namespace thermbal {

/// Keeps a scene as the daemon has it: asks, subscribes, takes the notifications, and connects again when the
/// daemon was away. One thread.
class LiveFeed {
  public:
    explicit LiveFeed(std::string socket) : socket_(std::move(socket)) {}

    /// The first connection. Errors: nobody is there, or it refuses.
    Result<void> open();

    /// Takes all that has come, connects again when it is time to. Returns the notifications taken.
    std::vector<Notification> update();

    /// -1 while there is no connection: update() is then to be called again within a second.
    int fd() const { return client_ ? client_->fd() : -1; }
    bool connected() const { return client_.has_value(); }
    /// Something has come already, whatever fd() says: update() is to be called at once.
    bool pending() const { return client_ && client_->kept() > 0; }
    const std::string& trouble() const { return trouble_; }

    /// Asks for the curve of the chosen channel.
    void refresh_curve();

    /// Asks the daemon beside what is kept. Errors: those of SocketClient; reopen_link while it is away.
    Result<nlohmann::json> ask(const char* method, const nlohmann::json& params = nlohmann::json::object());

    /// The scene, with its ages as of now.
    WatchScene& scene();

  private:
    using Clock = std::chrono::steady_clock;
    Result<void> fill();
    void take(const Notification& notification);
    void take_event(const nlohmann::json& event);
    /// Into `target` when the daemon answers.
    bool refresh(nlohmann::json& target, const char* method,
                 const nlohmann::json& params = nlohmann::json::object());
    void lose(const Error& error);

    std::string socket_;
    std::optional<SocketClient> client_;
    WatchScene scene_;
    std::size_t older_ = 0;  ///< notifications that came before the scene was asked for
    std::optional<Clock::time_point> scanned_at_;
    Clock::time_point lost_at_;
    Clock::time_point tried_at_;
    std::string trouble_;
};

}  // namespace thermbal
