#include "simulator/plant_source.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace thermbal {

PlantSource::PlantSource(Plant plant, NoiseOptions noise, double spindle_start_s)
    : plant_(std::move(plant)), running_(plant_.drive()), noise_(noise), spindle_start_s_(spindle_start_s) {}

std::vector<double> PlantSource::read_C(double time_s) {
    plant_.advance_to(time_s - spindle_start_s_);
    std::vector<double> values_C = plant_.sensor_C();
    for (std::size_t k = 0; k < values_C.size(); ++k)
        values_C[k] = measured_C(values_C[k], k, time_s, noise_);
    return values_C;
}

void PlantSource::run_spindle(double time_s, bool run) {
    plant_.advance_to(time_s - spindle_start_s_);
    plant_.set_drive(run ? running_ : Drive{});
}

RecordedTest record_warm_up(Plant plant, const NoiseOptions& noise, double period_s, double duration_s) {
    RecordedTest test;
    for (const PlantSensor& sensor : plant.description().sensors)
        test.channels.push_back({sensor.channel, {}});
    test.inputs.push_back({"spindle_rpm", {}});
    const double rpm = plant.drive().spindle_rpm;
    PlantSource source(std::move(plant), noise, 0.0);
    const auto scans = static_cast<std::size_t>(std::floor(duration_s / period_s + 1e-9)) + 1;
    for (std::size_t scan = 0; scan < scans; ++scan) {
        const double time_s = static_cast<double>(scan) * period_s;
        const std::vector<double> values_C = source.read_C(time_s);
        test.time_s.push_back(time_s);
        for (std::size_t k = 0; k < values_C.size(); ++k) test.channels[k].values.push_back(values_C[k]);
        test.inputs.front().values.push_back(rpm);
    }
    return test;
}

}  // namespace thermbal
