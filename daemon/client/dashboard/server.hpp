#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "access.hpp"
#include "live_state.hpp"

namespace thermbal {

struct DashboardOptions {
    ListenAddress address{"127.0.0.1", 8087};
    PageAccess access;
    std::size_t most_readers = 16;  ///< pages open at the same time; a further one is told to try later
};

/// The pages over HTTP, GET only. `state` is followed elsewhere. run() from one thread, stop() from any.
class DashboardServer {
  public:
    /// Binds. Errors (stop): the address cannot be had.
    static Result<DashboardServer> open(const DashboardOptions& options, LiveState& state);

    int port() const;
    /// Serves until stop().
    void run();
    void stop();

    DashboardServer(DashboardServer&&) noexcept;
    DashboardServer& operator=(DashboardServer&&) noexcept;
    ~DashboardServer();

  private:
    struct Parts;
    explicit DashboardServer(std::unique_ptr<Parts> parts);
    std::unique_ptr<Parts> parts_;
};

}  // namespace thermbal
