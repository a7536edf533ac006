#pragma once

#include <vector>

#include "series/recorded_test.hpp"
#include "simulator/noise.hpp"
#include "simulator/plant.hpp"

namespace thermbal {

/// A plant behind its sensors and the module's converter, in simulated time: the spindle stands until
/// `spindle_start_s`, which is plant time 0. Time only goes forward; a read of an earlier time gets the
/// present.
class PlantSource {
  public:
    PlantSource(Plant plant, NoiseOptions noise, double spindle_start_s);

    /// T1 ... T16 as the module converts them, C.
    std::vector<double> read_C(double time_s);
    /// Stops the spindle, or starts it again at the speed it had.
    void run_spindle(double time_s, bool run);

  private:
    Plant plant_;
    Drive running_;
    NoiseOptions noise_;
    double spindle_start_s_;
};

/// A warm-up as a recorded test, with spindle_rpm as known input: one row each `period_s` from 0 to
/// `duration_s`.
RecordedTest record_warm_up(Plant plant, const NoiseOptions& noise, double period_s, double duration_s);

}  // namespace thermbal
