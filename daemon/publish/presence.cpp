#include "presence.hpp"

#include <chrono>

namespace thermbal {

bool Presence::ask() {
    if (!client_) {
        auto client = SocketClient::connect(socket_);
        if (!client) return false;
        client_ = std::move(*client);
    }
    if (client_->ask("status", nlohmann::json::object(), std::chrono::seconds(2))) return true;
    client_.reset();
    return false;
}

bool Presence::is_running(double now_s) {
    constexpr double ask_every_s = 5.0;
    if (!asked_s_ || now_s - *asked_s_ >= ask_every_s) {
        running_ = ask();
        asked_s_ = now_s;
    }
    return running_;
}

}  // namespace thermbal
