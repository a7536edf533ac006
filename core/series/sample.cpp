#include "series/sample.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace thermbal {
namespace {

constexpr std::array<std::pair<Quality, std::string_view>, 9> quality_names{{
    {Quality::good, "good"},
    {Quality::open, "open"},
    {Quality::shorted, "short"},
    {Quality::over_range, "over_range"},
    {Quality::under_range, "under_range"},
    {Quality::stuck, "stuck"},
    {Quality::stale, "stale"},
    {Quality::communication, "communication"},
    {Quality::gap, "gap"},
}};

}  // namespace

std::string_view to_string(Quality quality) {
    for (const auto& [value, name] : quality_names) {
        if (value == quality) return name;
    }
    return "gap";
}

std::optional<Quality> quality_from_string(std::string_view name) {
    for (const auto& [value, known] : quality_names) {
        if (known == name) return value;
    }
    return std::nullopt;
}

double first_good(std::span<const double> values) {
    const auto found = std::ranges::find_if(values, [](double value) { return std::isfinite(value); });
    return found == values.end() ? no_value : *found;
}

double last_good(std::span<const double> values) {
    const auto found =
        std::find_if(values.rbegin(), values.rend(), [](double value) { return std::isfinite(value); });
    return found == values.rend() ? no_value : *found;
}

double mean_of_good(std::span<const double> values) {
    double sum = 0.0;
    std::size_t good = 0;
    for (const double value : values) {
        if (!std::isfinite(value)) continue;
        sum += value;
        ++good;
    }
    return good == 0 ? no_value : sum / static_cast<double>(good);
}

}  // namespace thermbal
