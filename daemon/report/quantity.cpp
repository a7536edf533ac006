#include "quantity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace thermbal {
namespace {

struct Unit {
    std::string_view suffix;
    std::string_view words;
    double size = 1.0;  ///< of the unit said, in that of the suffix
};

/// Longer suffixes first: "_W_per_K" ends with "_per_K".
constexpr std::array units = {
    Unit{"_J_per_K", "J/K"}, Unit{"_W_per_K", "W/K"}, Unit{"_C_per_h", "\u00b0C/h"},
    Unit{"_per_K", "1/K"},   Unit{"_W", "W"},         Unit{"_C", "\u00b0C"},
    Unit{"_h", "h"},         Unit{"_rad", "rad"},     Unit{"_s", "min", 60.0},
    Unit{"_min", "min"},
};

Unit unit_of(std::string_view name, double value) {
    const auto found =
        std::ranges::find_if(units, [&](const Unit& unit) { return name.ends_with(unit.suffix); });
    if (found == units.end()) return {"", ""};
    // A sensor's lag of half a minute is a lag of seconds.
    if (found->suffix == "_s" && std::abs(value) < 120.0) return {"_s", "s"};
    return *found;
}

/// Three digits, never an exponent where a person can do without.
std::string digits(double value) {
    return std::abs(value) >= 1000.0 && std::abs(value) < 1e9 ? fmt::format("{:.0f}", value)
                                                              : fmt::format("{:.3g}", value);
}

}  // namespace

std::string quantity_in_words(const std::string& name, double value, double low, double high) {
    const Unit unit = unit_of(name, value);
    std::string words = name.substr(0, name.size() - unit.suffix.size());
    std::ranges::replace(words, '_', ' ');
    return fmt::format("{} {}{}{} ({} to {})", words, digits(value / unit.size),
                       unit.words.empty() ? "" : " ", unit.words, digits(low / unit.size),
                       digits(high / unit.size));
}

}  // namespace thermbal
