#include "fields.hpp"

#include <cmath>

#include <fmt/format.h>

namespace thermbal {

using nlohmann::json;

namespace {

const json* member(const json& object, const char* key) {
    if (!object.is_object()) return nullptr;
    const auto found = object.find(key);
    return found == object.end() ? nullptr : &*found;
}

}  // namespace

std::optional<double> number(const json& object, const char* key) {
    const json* const found = member(object, key);
    if (found == nullptr || !found->is_number()) return std::nullopt;
    const double value = found->get<double>();
    return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::string text(const json& object, const char* key) {
    const json* const found = member(object, key);
    return found != nullptr && found->is_string() ? found->get<std::string>() : std::string();
}

bool flag(const json& object, const char* key) {
    const json* const found = member(object, key);
    return found != nullptr && found->is_boolean() && found->get<bool>();
}

const json& list(const json& object, const char* key) {
    static const json none = json::array();
    const json* const found = member(object, key);
    return found != nullptr && found->is_array() ? *found : none;
}

const json& object_in(const json& object, const char* key) {
    static const json none = json::object();
    const json* const found = member(object, key);
    return found != nullptr && found->is_object() ? *found : none;
}

std::string fixed(std::optional<double> value, int digits) {
    return value ? fmt::format("{:.{}f}", *value, digits) : std::string("-");
}

std::string with_sign(std::optional<double> value, int digits) {
    if (!value) return "-";
    const double smallest = 0.5 * std::pow(10.0, -digits);
    return fmt::format("{:+.{}f}", std::abs(*value) < smallest ? 0.0 : *value, digits);
}

std::string minutes(std::optional<double> value) {
    if (!value) return "-";
    return std::abs(*value) < 999.5 ? fmt::format("{:.0f} min", *value)
                                    : fmt::format("{:.1f} h", *value / 60.0);
}

std::string bytes(std::optional<double> value) {
    if (!value) return "-";
    if (*value < 1e3) return fmt::format("{:.0f} B", *value);
    if (*value < 1e6) return fmt::format("{:.1f} kB", *value / 1e3);
    return *value < 1e9 ? fmt::format("{:.1f} MB", *value / 1e6) : fmt::format("{:.2f} GB", *value / 1e9);
}

}  // namespace thermbal
