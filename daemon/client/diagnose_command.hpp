#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "database.hpp"

namespace thermbal {

struct DiagnoseCommand {
    std::string file;                  ///< recorded test; or
    std::optional<std::int64_t> test;  ///< a stored one, of
    DatabaseOptions database;
    std::string model;  ///< empty: the one that the stored test was compared with
    std::vector<std::string> holdouts;
    std::string write_model;  ///< the model with the effects found, TOML; empty: not written
    std::string report;       ///< HTML; empty: not written
    int threads = 2;
    bool json = false;
};

/// `thermbalctl diagnose`: what the model lacks, by the recorded test. Returns the exit status.
int run_diagnose(const DiagnoseCommand& command);

}  // namespace thermbal
