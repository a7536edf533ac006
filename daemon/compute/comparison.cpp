#include "compute/comparison.hpp"

#include <array>
#include <chrono>
#include <utility>

#include "network/simulate.hpp"

namespace thermbal {
namespace {

Result<std::vector<ChannelComparison>> at_newest_scan(const Model& model, const RecordedTest& test) {
    const std::array newest_s = {test.time_s.back()};
    const auto simulation = simulate(model, inputs_of(test), newest_s);
    if (!simulation) return std::unexpected(simulation.error());
    std::vector<ChannelComparison> channels;
    for (const Column& channel : test.channels) {
        const auto sensor = find_sensor(model, channel.name);
        if (!sensor) continue;
        channels.push_back({channel.name, channel.values.back(),
                            simulation->reading_C(0, static_cast<Eigen::Index>(*sensor))});
    }
    return channels;
}

}  // namespace

ComparisonResult compare(const ComparisonJob& job, const Cancelled& cancelled) {
    const auto started = std::chrono::steady_clock::now();
    const RecordedTest test = recording_of(job.window);
    ComparisonResult result{.generation = job.generation,
                            .scan = job.scan,
                            .channels = at_newest_scan(*job.model, test),
                            .agreement = {}};
    if (job.check) result.agreement = check_agreement(*job.model, test, job.disagreeing, {}, cancelled);
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    return result;
}

}  // namespace thermbal
