#include "checks.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "modbus/unit.hpp"

namespace thermbal {
namespace {

using Tables = std::vector<const toml::table*>;

void complain(Complaints& complaints, const toml::table* table, std::string_view key, std::string_view path,
              const std::string& what) {
    const toml::node* node = table->get(key);
    complaints.add(node == nullptr ? table->source() : node->source(), fmt::format("{}.{}", path, key), what);
}

/// Calls complain_about(i, j) for every entry i whose key an earlier entry j has already.
template <typename Entries, typename KeyOf, typename Complain>
void each_double(const Entries& entries, KeyOf key_of, Complain complain_about) {
    std::map<decltype(key_of(entries[0])), std::size_t> seen;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const auto [earlier, is_new] = seen.emplace(key_of(entries[i]), i);
        if (!is_new) complain_about(i, earlier->second);
    }
}

void check_names(const Config& config, const ConfigTables& tables, Complaints& complaints) {
    const auto twice = [&](const Tables& of, std::string_view path, const std::string& name, std::size_t i) {
        complain(complaints, of[i], "name", path,
                 fmt::format("\"{}\" is given twice; every name once", name));
    };
    each_double(
        config.lines, [](const LineConfig& line) { return line.link.name; },
        [&](std::size_t i, std::size_t) { twice(tables.lines, "line", config.lines[i].link.name, i); });
    each_double(
        config.units, [](const UnitConfig& unit) { return unit.name; },
        [&](std::size_t i, std::size_t) { twice(tables.units, "unit", config.units[i].name, i); });
    each_double(
        config.channels, [](const ChannelConfig& channel) { return channel.name; },
        [&](std::size_t i, std::size_t) { twice(tables.channels, "channel", config.channels[i].name, i); });
    each_double(
        config.alarms, [](const AlarmConfig& alarm) { return alarm.name; },
        [&](std::size_t i, std::size_t) { twice(tables.alarms, "alarm", config.alarms[i].name, i); });
}

void check_addresses(const Config& config, const ConfigTables& tables, Complaints& complaints) {
    each_double(
        config.units, [](const UnitConfig& unit) { return std::pair(unit.line, unit.unit_id); },
        [&](std::size_t i, std::size_t j) {
            const UnitConfig& unit = config.units[i];
            complain(complaints, tables.units[i], "unit_id", "unit",
                     fmt::format("{} on line \"{}\" is unit \"{}\" already", unit.unit_id,
                                 config.lines[unit.line].link.name, config.units[j].name));
        });
    each_double(
        config.channels, [](const ChannelConfig& channel) { return std::pair(channel.unit, channel.input); },
        [&](std::size_t i, std::size_t j) {
            const ChannelConfig& channel = config.channels[i];
            complain(complaints, tables.channels[i], "input", "channel",
                     fmt::format("{} of unit \"{}\" is channel {} already", channel.input,
                                 config.units[channel.unit].name, config.channels[j].name));
        });
    for (std::size_t i = 0; i < config.channels.size(); ++i) {
        const ChannelConfig& channel = config.channels[i];
        const UnitConfig& unit = config.units[channel.unit];
        if (channel.input <= unit.profile.inputs) continue;
        complain(complaints, tables.channels[i], "input", "channel",
                 fmt::format("found {}; accepted: 1 to {}, the inputs of unit \"{}\" (profile {})",
                             channel.input, unit.profile.inputs, unit.name, unit.profile_name));
    }
}

/// The last thing that a line's name says about its device: two lines on one port would never both open it.
std::string endpoint_of(const LineConfig& line) {
    if (line.usb) return describe(*line.usb);
    if (line.link.transport == Transport::rtu) return line.link.device;
    return fmt::format("{} port {}", line.link.host, line.link.port);
}

void check_lines(const Config& config, const ConfigTables& tables, Complaints& complaints) {
    each_double(config.lines, endpoint_of, [&](std::size_t i, std::size_t j) {
        complaints.add(
            tables.lines[i]->source(), "line",
            fmt::format("\"{}\" and \"{}\" are both on {}; one line with several units",
                        config.lines[j].link.name, config.lines[i].link.name, endpoint_of(config.lines[i])));
    });
    for (std::size_t i = 0; i < config.lines.size(); ++i) {
        double longest_s = 0.0;
        for (const UnitConfig& unit : config.units) {
            if (unit.line == i) {
                const LinkOptions& link = config.lines[i].link;
                longest_s +=
                    longest_unit_s(link, plan_unit(unit.unit_id, unit.profile, link.confirms_reads()));
            }
        }
        if (longest_s <= config.test.period_s) continue;
        complain(
            complaints, tables.lines[i], "response_timeout_ms", "line",
            fmt::format(
                "with {:.0f} ms, the units of line \"{}\" may take {:.1f} s when none answers, the period "
                "is {} s; accepted: a shorter timeout, fewer units on the line, or a longer period_s",
                config.lines[i].link.response_timeout_s * 1000.0, config.lines[i].link.name, longest_s,
                config.test.period_s));
    }
}

void check_roles(const Config& config, const ConfigTables& tables, Complaints& complaints) {
    std::size_t ambients = 0;
    for (std::size_t i = 0; i < config.channels.size(); ++i) {
        if (config.channels[i].role != ChannelConfig::Role::ambient || ++ambients < 2) continue;
        complain(complaints, tables.channels[i], "role", "channel",
                 "a second ambient; accepted: one channel or none");
    }
    const bool any_required = std::ranges::any_of(config.channels, &ChannelConfig::required);
    if (!any_required) {
        complaints.add(
            tables.root->source(), "channel",
            "no channel is required, so nothing would ever end the test; accepted: at least one channel "
            "with role = \"structure\" and required = true");
    }
}

void check_times(const Config& config, const ConfigTables& tables, Complaints& complaints) {
    if (config.identification.every_s >= config.test.period_s) return;
    const toml::table* table = tables.root->get_as<toml::table>("identification");
    complain(complaints, table == nullptr ? tables.root : table, "every_s", "identification",
             fmt::format("found {}; accepted: not less than test.period_s, which is {}",
                         config.identification.every_s, config.test.period_s));
}

}  // namespace

void check_config(const Config& config, const ConfigTables& tables, Complaints& complaints) {
    check_names(config, tables, complaints);
    check_addresses(config, tables, complaints);
    check_lines(config, tables, complaints);
    check_roles(config, tables, complaints);
    check_times(config, tables, complaints);
}

}  // namespace thermbal
