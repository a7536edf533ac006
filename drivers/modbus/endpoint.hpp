#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include <netinet/in.h>
#include <sys/socket.h>

#include "base/error.hpp"

namespace thermbal {

using MonotonicClock = std::chrono::steady_clock;
using Deadline = MonotonicClock::time_point;

int milliseconds_until(Deadline deadline);

struct Address {
    sockaddr_storage storage{};
    socklen_t length = 0;
    int family = 0;
};

/// Resolves host names in bounded time. getaddrinfo has no timeout of its own, so a name is looked up on a
/// thread that may outlive the call; a second call joins a look-up that is still under way instead of
/// starting another.
class Resolver {
  public:
    Result<std::vector<Address>> resolve(const std::string& host, int port, Deadline deadline);

  private:
    struct Lookup;
    std::shared_ptr<Lookup> pending_;
};

/// A connected stream socket (close-on-exec, blocking, no Nagle delay, keepalive) by the deadline, trying
/// each address of the host in turn; the caller closes it.
Result<int> connect_tcp(Resolver& resolver, const std::string& host, int port, Deadline deadline);

}  // namespace thermbal
