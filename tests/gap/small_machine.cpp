#include "small_machine.hpp"

#include <random>

#include "network/simulate.hpp"

namespace thermbal {

Model small_machine() {
    const auto about = [](double value) { return Uncertain{value, 0.2}; };
    Model model;
    model.name = "small";
    model.ambient.value_C = 20.0;
    model.nodes = {{"bearing", about(3000.0)}, {"housing", about(12000.0)}, {"bed", about(40000.0)}};
    model.links = {{"bearing", "housing", about(12.0)},
                   {"housing", "bed", about(10.0)},
                   {"housing", "ambient", about(4.0)},
                   {"bed", "ambient", about(7.0)}};
    model.sources = {{"bearing", "bearing", about(120.0), "spindle_rpm", 5000.0, {1.0, 0.0}}};
    model.sensors = {{"T1", "bearing", 0.05}, {"T2", "housing", 0.05}, {"T3", "bed", 0.05}};
    return model;
}

Model with_two_on_the_housing(Model model, double share) {
    model.sensors[1].place_share = share;
    model.sensors.push_back({"T4", "housing", 0.05, -share});
    return model;
}

RecordedTest measured_on(const Model& model, double minutes, double noise_C, unsigned seed) {
    RecordedTest test;
    Column rpm{"spindle_rpm", {}};
    for (double t = 0.0; t <= minutes * 60.0; t += 15.0) {
        test.time_s.push_back(t);
        rpm.values.push_back(t < minutes * 40.0 ? 5000.0 : 0.0);
    }
    test.inputs = {rpm};
    const Simulation simulation = simulate(model, inputs_of(test), test.time_s).value();
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, noise_C);
    for (std::size_t i = 0; i < model.sensors.size(); ++i) {
        Column channel{model.sensors[i].channel, {}};
        for (Eigen::Index row = 0; row < simulation.reading_C.rows(); ++row) {
            channel.values.push_back(simulation.reading_C(row, static_cast<Eigen::Index>(i)) + noise(random));
        }
        test.channels.push_back(channel);
    }
    return test;
}

}  // namespace thermbal
