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

LinkCounters added(const LinkCounters& sum, const LinkCounters& before, const LinkCounters& now) {
    LinkCounters result = sum;
    result.requests += now.requests - before.requests;
    result.replies += now.replies - before.replies;
    result.exceptions += now.exceptions - before.exceptions;
    result.timeouts += now.timeouts - before.timeouts;
    result.bad_frames += now.bad_frames - before.bad_frames;
    result.stray_bytes += now.stray_bytes - before.stray_bytes;
    result.connects += now.connects - before.connects;
    result.connect_failures += now.connect_failures - before.connect_failures;
    return result;
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
        const bool confirm = config.lines[line].link.confirms_reads();
        ConfiguredUnit configured{.plan = plan_unit(unit.unit_id, unit.profile, confirm), .channels = {}};
        configured.input_is_wrong.assign(static_cast<std::size_t>(unit.profile.inputs), false);
        for (std::size_t c = 0; c < config.channels.size(); ++c) {
            const ChannelConfig& channel = config.channels[c];
            if (channel.unit == u) {
                configured.channels.push_back(
                    {c, static_cast<std::size_t>(channel.input - 1), channel.calibration});
            }
        }
        units_.push_back(std::move(configured));
        LineHealth::Unit unit_health;
        unit_health.name = unit.name;
        unit_health.last_error = "not asked yet";
        health_.units.push_back(std::move(unit_health));
    }
}

std::vector<ChannelSample> ModbusLine::read_scan() {
    std::vector<ChannelSample> samples;
    for (std::size_t u = 0; u < units_.size(); ++u) {
        const ConfiguredUnit& unit = units_[u];
        const LinkCounters before = link_->counters();
        const UnitReading reading = read_unit(*link_, unit.plan, real_ns_);
        check_types(u, reading);
        for (const auto& [channel, input, calibration] : unit.channels) {
            Sample sample = calibrated(reading.samples[input], calibration);
            // The number is, or may be, of another kind of sensor: there is no trustworthy answer.
            if (sample.good() && !unit.trusts(input)) {
                sample = {.raw = sample.raw, .value_C = no_value, .quality = Quality::communication};
            }
            samples.push_back({channel, sample});
        }
        note(u, reading, before);
    }
    return samples;
}

void ModbusLine::check_types(std::size_t u, const UnitReading& reading) {
    using Types = ConfiguredUnit::Types;
    ConfiguredUnit& unit = units_[u];
    const ModuleProfile& profile = unit.plan.profile;
    if (!profile.type_code) return;
    if (reading.error) {
        unit.types = Types::unknown;  // whatever comes back may be another module
        return;
    }
    if (unit.types == Types::right || unit.types == Types::unreadable) return;
    const auto codes = read_type_codes(*link_, unit.plan.unit_id, profile);
    // A module may be silent on registers that it does not have, instead of saying so.
    constexpr int most_unanswered = 3;
    const bool is_silent = !codes && codes.error().next != NextStep::retry;
    if (is_silent && ++unit.unanswered_type_reads < most_unanswered) return;
    unit.unanswered_type_reads = 0;
    const std::string wrong = codes ? wrong_types(profile, *codes) : std::string();
    const Types found = !codes ? Types::unreadable : wrong.empty() ? Types::right : Types::wrong;
    for (std::size_t input = 0; input < unit.input_is_wrong.size(); ++input) {
        unit.input_is_wrong[input] =
            codes && !wrong_types(profile, std::span(*codes).subspan(input, 1)).empty();
    }
    std::string name;
    bool was_wrong = false;
    {
        const std::lock_guard lock(mutex_);
        name = fmt::format("{}, unit {}", health_.name, health_.units[u].name);
        was_wrong = !health_.units[u].wrong_types.empty();
        health_.units[u].wrong_types = wrong;
    }
    const bool is_new = std::exchange(unit.types, found) != found;
    if (found == Types::wrong && is_new && !was_wrong) {
        log_(fmt::format("{}: {}; what it reads there is marked until the module is set", name, wrong), true);
    } else if (found == Types::unreadable && is_new) {
        log_(fmt::format("{}: its type codes cannot be read ({}); its readings are taken as they are", name,
                         codes.error().message),
             true);
    } else if (found == Types::right && was_wrong) {
        log_(fmt::format("{}: its type codes are those of the profile now", name), false);
    }
}

void ModbusLine::note(std::size_t u, const UnitReading& reading, const LinkCounters& before) {
    const bool answering = !reading.error.has_value();
    bool changed = false;
    std::string message;
    {
        const std::lock_guard lock(mutex_);
        LineHealth::Unit& unit = health_.units[u];
        changed = unit.answering != answering || (!answering && unit.failures == 0);
        unit.answering = answering;
        unit.round_trip_ms = static_cast<double>(reading.reply_ns - reading.request_ns) * 1e-6;
        if (answering) {
            unit.round_trips.add(unit.round_trip_ms);
        } else {
            ++unit.failures;
            unit.last_error = reading.error->message;
        }
        unit.errors = added(unit.errors, before, link_->counters());
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
