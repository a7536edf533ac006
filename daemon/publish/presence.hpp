#pragma once

#include <optional>
#include <string>

#include "socket_client.hpp"

namespace thermbal {

/// Whether thermbald runs: asked over its socket, at most every 5 s; between that, the last answer.
class Presence {
  public:
    explicit Presence(std::string socket) : socket_(std::move(socket)) {}
    /// Waits at most 2 s for an answer. `now_s` never falls.
    bool is_running(double now_s);

  private:
    bool ask();

    std::string socket_;
    std::optional<SocketClient> client_;
    std::optional<double> asked_s_;
    bool running_ = false;
};

}  // namespace thermbal
