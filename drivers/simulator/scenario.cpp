#include "simulator/scenario.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <toml++/toml.h>

namespace thermbal {
namespace {

constexpr std::array<std::string_view, 6> known_keys = {"kind", "value", "unit", "channel", "at_s", "for_s"};

class ScenarioReader {
  public:
    explicit ScenarioReader(std::string_view file_name) : file_name_(file_name) {}

    Result<std::vector<Fault>> read(const toml::table& root) const {
        std::vector<Fault> faults;
        for (const auto& [key, node] : root) {
            if (key.str() != "fault" || !node.is_array_of_tables()) {
                return refuse(node, fmt::format("'{}'; accepted: [[fault]] tables", key.str()));
            }
            for (const toml::node& table : *node.as_array()) {
                auto fault = read_fault(*table.as_table());
                if (!fault) return std::unexpected(fault.error());
                faults.push_back(*fault);
            }
        }
        return faults;
    }

    std::unexpected<Error> refuse(const toml::source_region& at, std::string_view what) const {
        return fail(NextStep::refuse_input, fmt::format("{}:{}: {}", file_name_, at.begin.line, what));
    }

  private:
    std::unexpected<Error> refuse(const toml::node& node, std::string_view what) const {
        return refuse(node.source(), what);
    }

    Result<Fault> read_fault(const toml::table& table) const {
        for (const auto& [key, node] : table) {
            if (std::ranges::find(known_keys, key.str()) == known_keys.end()) {
                return refuse(node,
                              fmt::format("'{}'; accepted: {}", key.str(), fmt::join(known_keys, ", ")));
            }
        }
        const auto text = kind_text(table);
        if (!text) return std::unexpected(text.error());
        auto fault = parse_fault_kind(*text);
        if (!fault) return refuse(table, fault.error().message);
        const auto at_s = seconds(table, "at_s");
        if (!at_s || !*at_s) return refuse(table, "at_s is missing or no time from 0 s on");
        const auto for_s = seconds(table, "for_s");
        if (!for_s || *for_s == 0.0) return refuse(table, "for_s is no duration above 0 s");
        fault->from_s = **at_s;
        if (*for_s) fault->to_s = fault->from_s + **for_s;
        return fault;
    }

    /// KIND[=VALUE][:TARGET], which says by itself what fits.
    Result<std::string> kind_text(const toml::table& table) const {
        const auto kind = table["kind"].value<std::string>();
        if (!kind) return refuse(table, "kind is missing; accepted: the name of a fault");
        if (table.contains("unit") && table.contains("channel"))
            return refuse(table, "both unit and channel");
        std::string text = *kind;
        if (const toml::node* node = table.get("value")) {
            const auto value = node->value<double>();
            if (!value) return refuse(*node, "value; accepted: a number");
            text += fmt::format("={}", *value);
        }
        if (const toml::node* node = table.get("unit")) {
            // Exactly an integer: toml++ 3.1 converts 1e308 without looking.
            const auto unit = node->value_exact<std::int64_t>();
            if (!unit) return refuse(*node, "unit; accepted: a whole number");
            text += fmt::format(":{}", *unit);
        }
        if (const toml::node* node = table.get("channel")) {
            const auto channel = node->value<std::string>();
            if (!channel) return refuse(*node, "channel; accepted: \"T1\" ... \"T16\"");
            text += ":" + *channel;
        }
        return text;
    }

    /// Nothing when the key is not there; an error when it is no time.
    static std::expected<std::optional<double>, bool> seconds(const toml::table& table,
                                                              std::string_view key) {
        if (!table.contains(key)) return std::optional<double>();
        const auto value = table[key].value<double>();
        if (!value || !std::isfinite(*value) || *value < 0.0) return std::unexpected(false);
        return value;
    }

    std::string_view file_name_;
};

}  // namespace

Result<std::vector<Fault>> parse_scenario(std::string_view toml, std::string_view file_name) {
    const ScenarioReader reader(file_name);
    try {
        return reader.read(toml::parse(toml, file_name));
    } catch (const toml::parse_error& error) {
        return reader.refuse(error.source(), error.description());
    }
}

}  // namespace thermbal
