#include "modbus_line.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "serial/ports.hpp"

namespace thermbal {
namespace {

std::unique_ptr<Link> link_of(const LineConfig& line) {
    LinkOptions options = line.link;
    if (line.usb) options.find_device = [selector = *line.usb] { return find_port(selector); };
    return make_link(std::move(options));
}

Sample calibrated(Sample sample, const Calibration& calibration) {
    if (!sample.good() || calibration.none()) return sample;
    sample.source_C = sample.value_C;
    sample.value_C = calibrated_C(calibration, sample.source_C);
    if (std::isfinite(sample.value_C)) return sample;
    // Beyond what a platinum sensor can be: the module's number was no reading of one.
    return {.raw = sample.raw,
            .value_C = no_value,
            .quality = sample.source_C > 0.0 ? Quality::over_range : Quality::under_range};
}

}  // namespace

ModbusLine::ModbusLine(const Config& config, std::size_t line, std::function<std::int64_t()> real_ns, Log log)
    : link_(link_of(config.lines[line])), real_ns_(std::move(real_ns)), log_(std::move(log)) {
    health_.name = config.lines[line].link.name;
    for (std::size_t u = 0; u < config.units.size(); ++u) {
        const UnitConfig& unit = config.units[u];
        if (unit.line != line) continue;
        ConfiguredUnit configured{plan_unit(unit.unit_id, unit.profile), {}};
        for (std::size_t c = 0; c < config.channels.size(); ++c) {
            const ChannelConfig& channel = config.channels[c];
            if (channel.unit == u) {
                configured.channels.push_back(
                    {c, static_cast<std::size_t>(channel.input - 1), channel.calibration});
            }
        }
        units_.push_back(std::move(configured));
        health_.units.push_back({unit.name, false, "not asked yet", 0.0, 0});
    }
}

std::vector<ChannelSample> ModbusLine::read_scan() {
    std::vector<ChannelSample> samples;
    for (std::size_t u = 0; u < units_.size(); ++u) {
        const ConfiguredUnit& unit = units_[u];
        const UnitReading reading = read_unit(*link_, unit.plan, real_ns_);
        for (const auto& [channel, input, calibration] : unit.channels) {
            samples.push_back({channel, calibrated(reading.samples[input], calibration)});
        }
        note(u, reading);
    }
    return samples;
}

void ModbusLine::note(std::size_t u, const UnitReading& reading) {
    const bool answering = !reading.error.has_value();
    bool changed = false;
    std::string message;
    {
        const std::lock_guard lock(mutex_);
        LineHealth::Unit& unit = health_.units[u];
        changed = unit.answering != answering || (!answering && unit.failures == 0);
        unit.answering = answering;
        unit.round_trip_ms = static_cast<double>(reading.reply_ns - reading.request_ns) * 1e-6;
        if (!answering) {
            ++unit.failures;
            unit.last_error = reading.error->message;
        }
        message = answering ? fmt::format("{}, unit {}: answering", health_.name, unit.name)
                            : fmt::format("{}, unit {}: {}; its channels are marked until it answers again",
                                          health_.name, unit.name, reading.error->message);
        health_.counters = link_->counters();
    }
    if (changed) log_(message, !answering);
}

Result<void> ModbusLine::write(const RegisterWrite& write) {
    return write.coil ? link_->write_coil(write.unit_id, write.address, write.value != 0)
                      : link_->write_register(write.unit_id, write.address, write.value);
}

LineHealth ModbusLine::health() const {
    const std::lock_guard lock(mutex_);
    return health_;
}

}  // namespace thermbal
