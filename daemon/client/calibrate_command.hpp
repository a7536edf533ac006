#pragma once

#include <string>

namespace thermbal {

struct CalibrateCommand {
    std::string file;
    std::string model;
    std::string write_model;  ///< empty: nowhere
    bool json = false;
};

/// `thermbalctl calibrate`: a model's numbers fitted to a recorded test, and how well each is known now.
/// Returns the exit status.
int run_calibrate(const CalibrateCommand& command);

}  // namespace thermbal
