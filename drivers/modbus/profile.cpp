#include "modbus/profile.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace thermbal {
namespace {

constexpr std::array<std::pair<RegisterType, std::string_view>, 5> type_names{
    {{RegisterType::int16, "int16"},
     {RegisterType::uint16, "uint16"},
     {RegisterType::int32, "int32"},
     {RegisterType::uint32, "uint32"},
     {RegisterType::float32, "float32"}}};
constexpr std::array<std::pair<ByteOrder, std::string_view>, 4> order_names{{{ByteOrder::abcd, "abcd"},
                                                                             {ByteOrder::cdab, "cdab"},
                                                                             {ByteOrder::badc, "badc"},
                                                                             {ByteOrder::dcba, "dcba"}}};

std::uint16_t swap_bytes(std::uint16_t word) {
    return static_cast<std::uint16_t>(word << 8 | word >> 8);
}

bool bytes_swapped(ByteOrder order) {
    return order == ByteOrder::badc || order == ByteOrder::dcba;
}
bool words_swapped(ByteOrder order) {
    return order == ByteOrder::cdab || order == ByteOrder::dcba;
}

std::uint32_t join(std::uint16_t high, std::uint16_t low) {
    return static_cast<std::uint32_t>(high) << 16 | static_cast<std::uint32_t>(low);
}

/// The value's bits, most significant first, whatever the order on the wire.
std::uint32_t value_bits(const ModuleProfile& profile, std::span<const std::uint16_t> registers) {
    const auto in_order = [&](std::uint16_t word) {
        return bytes_swapped(profile.byte_order) ? swap_bytes(word) : word;
    };
    if (registers_per_value(profile.type) == 1) return in_order(registers[0]);
    const std::uint16_t first = in_order(registers[0]);
    const std::uint16_t second = in_order(registers[1]);
    return words_swapped(profile.byte_order) ? join(second, first) : join(first, second);
}

double number_of(RegisterType type, std::uint32_t bits) {
    switch (type) {
        case RegisterType::int16:
            return static_cast<std::int16_t>(static_cast<std::uint16_t>(bits));
        case RegisterType::uint16:
            return bits;
        case RegisterType::int32:
            return static_cast<std::int32_t>(bits);
        case RegisterType::uint32:
            return bits;
        case RegisterType::float32:
            return std::bit_cast<float>(bits);
    }
    return no_value;
}

std::uint32_t bits_of(RegisterType type, double number) {
    const auto clamped = [&](double low, double high) {
        return static_cast<std::int64_t>(std::clamp(std::round(number), low, high));
    };
    switch (type) {
        case RegisterType::int16:
            return static_cast<std::uint16_t>(clamped(-32768, 32767));
        case RegisterType::uint16:
            return static_cast<std::uint16_t>(clamped(0, 65535));
        case RegisterType::int32:
            return static_cast<std::uint32_t>(clamped(-2147483648.0, 2147483647.0));
        case RegisterType::uint32:
            return static_cast<std::uint32_t>(clamped(0, 4294967295.0));
        case RegisterType::float32:
            return std::bit_cast<std::uint32_t>(static_cast<float>(number));
    }
    return 0;
}

Quality quality_of(const ModuleProfile& profile, double number, double value_C) {
    for (const FaultCode& fault : profile.faults) {
        if (number >= fault.first && number <= fault.last) return fault.quality;
    }
    if (std::isnan(value_C)) return profile.nan_quality;
    if (value_C > profile.valid_max_C) return Quality::over_range;
    if (value_C < profile.valid_min_C) return Quality::under_range;
    return Quality::good;
}

/// 304 tenths are the double 30.4, which 304 * 0.1 is not.
double scaled(double number, double scale) {
    const double per_unit = std::round(1.0 / scale);
    return per_unit * scale == 1.0 ? number / per_unit : number * scale;
}

}  // namespace

std::string_view to_string(RegisterType type) {
    return std::ranges::find(type_names, type, &std::pair<RegisterType, std::string_view>::first)->second;
}

std::optional<RegisterType> register_type_from_string(std::string_view name) {
    const auto found =
        std::ranges::find(type_names, name, &std::pair<RegisterType, std::string_view>::second);
    return found == type_names.end() ? std::nullopt : std::optional(found->first);
}

std::string_view to_string(ByteOrder order) {
    return std::ranges::find(order_names, order, &std::pair<ByteOrder, std::string_view>::first)->second;
}

std::optional<ByteOrder> byte_order_from_string(std::string_view name) {
    const auto found = std::ranges::find(order_names, name, &std::pair<ByteOrder, std::string_view>::second);
    return found == order_names.end() ? std::nullopt : std::optional(found->first);
}

int registers_per_value(RegisterType type) {
    return type == RegisterType::int16 || type == RegisterType::uint16 ? 1 : 2;
}

std::string check_profile(const ModuleProfile& profile) {
    const int width = registers_per_value(profile.type);
    if (profile.function != 3 && profile.function != 4) {
        return fmt::format("function is {}; 3 (holding registers) or 4 (input registers)", profile.function);
    }
    if (profile.inputs < 1 || profile.inputs > 256) {
        return fmt::format("inputs is {}; 1 to 256", profile.inputs);
    }
    if (profile.stride < width || profile.stride > 65535) {
        return fmt::format("stride is {}; {} or more: an input of type {} takes that many registers",
                           profile.stride, width, to_string(profile.type));
    }
    const long last = static_cast<long>(profile.first_register) +
                      static_cast<long>(profile.inputs - 1) * profile.stride + width - 1;
    if (profile.first_register < 0 || last > 65535) {
        return fmt::format("the registers go from {} to {}; they have to lie in 0 to 65535",
                           profile.first_register, last);
    }
    if (!std::isfinite(profile.scale) || profile.scale == 0.0) {
        return fmt::format("scale is {}; a number other than 0", profile.scale);
    }
    if (!std::isfinite(profile.offset_C)) return fmt::format("offset_C is {}; a number", profile.offset_C);
    if (!std::isfinite(profile.valid_min_C) || !std::isfinite(profile.valid_max_C) ||
        profile.valid_min_C >= profile.valid_max_C) {
        return fmt::format("the valid range is {} to {} C; two numbers, the lower one first",
                           profile.valid_min_C, profile.valid_max_C);
    }
    if (profile.nan_quality == Quality::good) return "nan_quality is good; a NaN is not a temperature";
    if (profile.type_code) {
        const TypeCode& code = *profile.type_code;
        const long end =
            static_cast<long>(code.first_register) + static_cast<long>(profile.inputs - 1) * code.stride;
        if (code.accepted.empty()) return "type_code.accepted is empty; the codes of a PT100";
        if (code.first_register < 0 || code.stride < 0 || end > 65535) {
            return fmt::format("the type codes go from {} to {}; they have to lie in 0 to 65535",
                               code.first_register, end);
        }
    }
    for (const FaultCode& fault : profile.faults) {
        if (!(fault.first <= fault.last)) {
            return fmt::format("a fault code from {} to {}; the lower number first", fault.first, fault.last);
        }
        if (fault.quality == Quality::good) return fmt::format("fault code {} means good", fault.first);
    }
    return {};
}

Sample decode(const ModuleProfile& profile, std::span<const std::uint16_t> registers) {
    Sample sample{.raw = std::nullopt, .value_C = no_value, .quality = Quality::communication};
    const auto width = static_cast<std::size_t>(registers_per_value(profile.type));
    if (registers.size() < width) return sample;
    sample.raw = width == 1 ? registers[0] : join(registers[0], registers[1]);
    const double number = number_of(profile.type, value_bits(profile, registers));
    const double value_C = scaled(number, profile.scale) + profile.offset_C;
    sample.quality = quality_of(profile, number, value_C);
    if (sample.quality == Quality::good) sample.value_C = value_C;
    return sample;
}

std::vector<std::uint16_t> encode(const ModuleProfile& profile, double value_C) {
    const std::uint32_t bits = bits_of(profile.type, (value_C - profile.offset_C) / profile.scale);
    const auto on_wire = [&](std::uint32_t word) {
        const auto word16 = static_cast<std::uint16_t>(word & 0xFFFF);
        return bytes_swapped(profile.byte_order) ? swap_bytes(word16) : word16;
    };
    if (registers_per_value(profile.type) == 1) return {on_wire(bits)};
    if (words_swapped(profile.byte_order)) return {on_wire(bits), on_wire(bits >> 16)};
    return {on_wire(bits >> 16), on_wire(bits)};
}

}  // namespace thermbal
