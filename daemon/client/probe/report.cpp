#include "report.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "columns.hpp"
#include "config/load.hpp"
#include "new_configuration.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

constexpr std::size_t most_channels = 99;

std::string format_of(const Reading& reading) {
    const ModuleProfile& profile = reading.profile;
    const bool wide = registers_per_value(profile.type) == 2;
    const std::string order = wide || profile.byte_order != ByteOrder::abcd
                                  ? fmt::format(" {}", to_string(profile.byte_order))
                                  : "";
    return fmt::format("{}{} x {}{}", to_string(profile.type), order, profile.scale,
                       reading.is_resistance ? " ohm (PT100)" : " C");
}

std::string values_of(const Reading& reading) {
    std::string text;
    for (std::size_t i = 0; i < reading.values_C.size() && i < 8; ++i) {
        text += (i == 0 ? "" : " ") + (std::isfinite(reading.values_C[i])
                                           ? fmt::format("{:.1f}", reading.values_C[i])
                                           : std::string("fault?"));
    }
    return text + (reading.values_C.size() > 8 ? " ..." : "");
}

std::string settings_of(const LinkOptions& link) {
    if (link.transport != Transport::rtu) return fmt::format("{} port {}", link.host, link.port);
    return fmt::format("{} {} baud 8{}{}", link.device, link.baud, link.parity, link.stop_bits);
}

std::string unit_text(const ProbedUnit& unit) {
    std::string text = fmt::format("\nunit {} on {}\n", unit.unit_id, settings_of(unit.link));
    for (const ProfileFit& fit : unit.fits) {
        text += fmt::format(
            "  fits profile {}: {:.0f} % of {} inputs read like temperatures or its fault codes{}{}\n",
            fit.profile.name, 100.0 * fit.fit, fit.profile.inputs,
            fit.types.empty() ? "" : "; its type codes ", fit.types);
    }
    if (unit.readings.empty()) return text + "  no registers that read like temperatures\n";
    TextTable table(
        {{"  function"}, {"from", true}, {"inputs", true}, {"read as"}, {"speaks for it", true}, {"C"}});
    for (const Reading& reading : unit.readings) {
        table.add({fmt::format("  {}", reading.profile.function),
                   fmt::format("{}", reading.profile.first_register),
                   fmt::format("{}", reading.profile.inputs), format_of(reading),
                   fmt::format("{:.1f}", reading.score), values_of(reading)});
    }
    return text + table.str();
}

json number_or_null_of(double value) {
    return std::isfinite(value) ? json(value) : json(nullptr);
}

json reading_json(const Reading& reading) {
    json values = json::array();
    for (const double value : reading.values_C) values.push_back(number_or_null_of(value));
    return {{"function", reading.profile.function},
            {"first_register", reading.profile.first_register},
            {"inputs", reading.profile.inputs},
            {"type", to_string(reading.profile.type)},
            {"byte_order", to_string(reading.profile.byte_order)},
            {"scale", reading.profile.scale},
            {"is_resistance", reading.is_resistance},
            {"score", reading.score},
            {"values_C", std::move(values)}};
}

json unit_json(const ProbedUnit& unit) {
    json fits = json::array();
    for (const ProfileFit& fit : unit.fits) {
        fits.push_back({{"profile", fit.profile.name},
                        {"fit", fit.fit},
                        {"inputs", fit.profile.inputs},
                        {"types_confirmed", fit.types_confirmed},
                        {"types", fit.types}});
    }
    json readings = json::array();
    for (const Reading& reading : unit.readings) readings.push_back(reading_json(reading));
    json blocks = json::array();
    for (const RegisterBlock& block : unit.blocks) {
        blocks.push_back({{"function", block.function}, {"first", block.first}, {"words", block.words}});
    }
    return {{"unit_id", unit.unit_id},
            {"line", settings_of(unit.link)},
            {"profiles", std::move(fits)},
            {"readings", std::move(readings)},
            {"blocks", std::move(blocks)}};
}

/// The profile that a unit is to be read by: a shipped one that fits whole and leaves no more than a quarter
/// of what reads like temperatures unread (4 of 6 inputs is another module), else the best reading.
struct Choice {
    const ProbedUnit* unit = nullptr;
    ModuleProfile profile;
    bool shipped = false;
};

std::optional<Choice> choose(const ProbedUnit& unit) {
    const auto temperature = std::ranges::find(unit.readings, false, &Reading::is_resistance);
    if (!unit.fits.empty()) {
        const ProfileFit& best = unit.fits.front();
        const bool covers =
            temperature == unit.readings.end() ||
            best.profile.inputs * registers_per_value(best.profile.type) * 4 >=
                temperature->profile.inputs * registers_per_value(temperature->profile.type) * 3;
        if (best.types_confirmed || (best.fit >= 0.6 && covers)) return Choice{&unit, best.profile, true};
    }
    if (temperature == unit.readings.end()) return std::nullopt;
    Choice choice{&unit, temperature->profile, false};
    choice.profile.source =
        "found by thermbalctl probe: compare it with the manual of the module, fault codes above all";
    if (registers_per_value(choice.profile.type) == 1) {
        choice.profile.faults = {{32767.0, 32767.0, Quality::open}, {-32768.0, -32768.0, Quality::shorted}};
        if (choice.profile.type == RegisterType::uint16) {
            choice.profile.faults = {{65535.0, 65535.0, Quality::open}, {32767.0, 32768.0, Quality::open}};
        }
    }
    return choice;
}

}  // namespace

std::string probe_text(const ProbeResult& result) {
    std::string text = fmt::format("{} requests, read only; {} {}\n", result.requests, result.units.size(),
                                   result.units.size() == 1 ? "unit answered" : "units answered");
    for (const std::string& trouble : result.trouble) text += printable(trouble) + "\n";
    if (result.out_of_time) text += "the time was over before everything was asked: see --limit-s\n";
    for (const ProbedUnit& unit : result.units) text += unit_text(unit);
    return text;
}

json probe_json(const ProbeResult& result) {
    json units = json::array();
    for (const ProbedUnit& unit : result.units) units.push_back(unit_json(unit));
    json document = {{"requests", result.requests},
                     {"out_of_time", result.out_of_time},
                     {"trouble", result.trouble},
                     {"units", std::move(units)}};
    if (const auto start = starting_point(result)) {
        document["profile_name"] = start->profile_name;
        document["profile_toml"] = start->profile_toml;
        document["config_toml"] = start->config_toml;
    }
    return document;
}

Result<StartingPoint> starting_point(const ProbeResult& result) {
    StartingPoint start;
    NewConfiguration found;
    std::vector<int> inputs;
    for (const ProbedUnit& unit : result.units) {
        auto choice = choose(unit);
        if (!choice) continue;
        if (!choice->shipped) {
            choice->profile.name = "probed";
            // One new profile for all units that have none: different modules on one line are a person's
            // work.
            if (start.profile_name.empty()) start.profile_toml = explain_profile(choice->profile);
            start.profile_name = "probed";
        }
        found.units.push_back({unit.unit_id, choice->profile.name});
        inputs.push_back(choice->profile.inputs);
    }
    if (found.units.empty()) {
        return fail(NextStep::stop,
                    "no unit gave registers that read like temperatures: nothing to start from");
    }
    // It was asked with patience of its own; the daemon's is another.
    const double timeout_s = found.link.response_timeout_s;
    found.link = result.units.front().link;
    found.link.response_timeout_s = timeout_s;
    found.channels = channels_of_inputs(inputs, most_channels, "T1");
    start.config_toml =
        "# Made by thermbalctl probe. Give the channels their places, and say which is the ambient.\n" +
        modules_text(found);
    return start;
}

}  // namespace thermbal
