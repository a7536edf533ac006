#pragma once

#include <string>
#include <vector>

namespace thermbal {

struct DiagnoseCommand {
    std::string file;
    std::string model;
    std::vector<std::string> holdouts;
    std::string write_model;  ///< the model with the effects found, TOML; empty: not written
    std::string report;       ///< HTML; empty: not written
    int threads = 2;
    bool json = false;
};

/// `thermbalctl diagnose`: what the model lacks, by the recorded test. Returns the exit status.
int run_diagnose(const DiagnoseCommand& command);

}  // namespace thermbal
