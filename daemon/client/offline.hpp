#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "declaration/live_flow.hpp"

namespace thermbal {

struct OfflineOptions {
    std::string file;
    std::string ambient = "T1";         ///< "none": no ambient channel
    std::vector<std::string> channels;  ///< only these are reported; empty: all
    std::optional<double> until_min;
    std::string archive;  ///< database with earlier tests of the machine
    std::string machine;  ///< whose earlier tests; empty: the newest of any
    double tolerance_C = 0.2;
    double every_min = 2.0;
    int threads = 2;
    bool modes_only = false;  ///< a study: the shared modes without the SVR criterion
    bool json = false;
};

/// `thermbalctl identify`: the live flow once, on the samples up to until_min. Returns the exit status.
int run_identify(const OfflineOptions& options);

struct LearnOptions {
    std::vector<std::string> files;
    std::string archive;
    std::string machine;
    std::string ambient = "T1";
    std::int64_t now_wall_ns = 0;
};

/// `thermbalctl learn`: what complete recorded tests teach about a machine goes into an archive database.
int run_learn(const LearnOptions& options);

/// `thermbalctl replay`: the growing window as the daemon would have run it, to the stop of the test.
int run_replay(const OfflineOptions& options);

}  // namespace thermbal
