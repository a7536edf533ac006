#include "soaked_line.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#include "acquisition/clock.hpp"

namespace thermbal::soak {
namespace {

/// As config/profiles/generic-8x-int16.toml.
ModuleProfile profile(const Layout& layout) {
    ModuleProfile generic;
    generic.name = "generic-8x-int16";
    generic.inputs = static_cast<int>(layout.inputs_per_unit());
    generic.faults = {{.first = 32767, .last = 32767, .quality = Quality::open},
                      {.first = -32768, .last = -32768, .quality = Quality::shorted}};
    return generic;
}

}  // namespace

SoakedLine::SoakedLine(Rig& rig, const LinkOptions& options)
    : rig_(rig), options_(options), link_(make_link(options)) {
    for (int unit = 1; unit <= static_cast<int>(rig.layout().units); ++unit) {
        plans_.push_back(plan_unit(unit, profile(rig.layout()), options.confirms_reads()));
        bound_s_ += longest_unit_s(options_, plans_.back());
    }
}

std::vector<ChannelSample> SoakedLine::read_scan() {
    // A period is longer than the pause after a failed opening; lockstep has no period of its own.
    if (!facts_.error.empty()) {
        std::this_thread::sleep_for(std::chrono::duration<double>(options_.longest_pause_s));
    }
    rig_.begin_scan(scan_++);
    const std::uint64_t faults_before = rig_.faults_begun();
    const bool quiet = rig_.quiet();
    facts_ = {};
    // What was held back during the scan before, or behind it, may come during this one.
    const double stalled_before_s = host_stalled_s();
    stalls_.reset();
    rig_.reset_stall();
    const std::int64_t started_ns = real_monotonic_ns();
    std::vector<ChannelSample> samples;
    for (const UnitPlan& plan : plans_) {
        const UnitReading reading = read_unit(*link_, plan, real_monotonic_ns);
        if (reading.error && facts_.error.empty()) facts_.error = reading.error->message;
        for (const Sample& sample : reading.samples) samples.push_back({samples.size(), sample});
    }
    facts_.took_s = static_cast<double>(real_monotonic_ns() - started_ns) * 1e-9;
    facts_.host_stalled_s = std::max(host_stalled_s(), stalled_before_s);
    facts_.clean = quiet && rig_.faults_begun() == faults_before;
    return samples;
}

}  // namespace thermbal::soak
