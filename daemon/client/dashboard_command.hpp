#pragma once

#include <string>
#include <vector>

namespace thermbal {

struct DashboardCommand {
    std::string socket;
    std::string listen = "127.0.0.1:8087";
    bool beyond_this_machine = false;  ///< an address that is not loopback is meant
    std::string token_file;
    std::vector<std::string> hosts;  ///< further names that the page is opened under
    std::size_t most_readers = 16;
};

/// `thermbalctl dashboard`: serves until a signal ends it. Returns the exit status.
int run_dashboard(const DashboardCommand& command);

}  // namespace thermbal
