#pragma once

#include <string>

namespace thermbal {

struct DemoOptions {
    std::string condition = "5000-idle";
    bool rtu = false;    ///< on a pseudo-terminal instead of TCP
    std::string folder;  ///< where everything stays; empty: a temporary folder that is removed
    bool report = true;  ///< with a folder: this program has a command that writes report.html
};

/// `thermbalctl demo`: thermbal-sim and thermbald beside this program, one test faster than time, and where
/// each channel settles beside where the simulated machine really does. Without root; on the loopback only.
/// Returns the exit status.
int run_demo(const DemoOptions& options);

}  // namespace thermbal
