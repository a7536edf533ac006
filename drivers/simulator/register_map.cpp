#include "simulator/register_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace thermbal {
namespace {

std::vector<std::pair<std::uint16_t, std::uint16_t>> repeated(std::uint16_t first, std::uint16_t stride,
                                                              std::uint16_t count, std::uint16_t value) {
    std::vector<std::pair<std::uint16_t, std::uint16_t>> constants;
    constants.reserve(count);
    for (std::uint16_t i = 0; i < count; ++i) {
        constants.emplace_back(static_cast<std::uint16_t>(first + i * stride), value);
    }
    return constants;
}

RegisterMap mb8art() {
    RegisterMap map{
        .name = "mb8art", .description = "MB8ART: 8 channels, FC 4 from 0, int16 x 0.1 C", .holding = false};
    map.open_code = 30000;
    map.short_code = static_cast<std::uint16_t>(-30000);
    map.most_channels = 8;
    map.constants = repeated(128, 1, 8, 0x0200);  // input type PT100
    map.constants.emplace_back(76, 0);            // resolution 0.1 C
    return map;
}

RegisterMap wb_mai11() {
    RegisterMap map{
        .name = "wb-mai11",
        .description = "Wiren Board WB-MAI11: 11 inputs, FC 4 at 0x1504, 0x2504, ..., int16 x 0.1 C",
        .holding = false};
    map.first = 0x1504;
    map.stride = 0x1000;
    map.short_code = 0x7FFF;  // one code for every fault
    map.most_channels = 11;
    map.constants = repeated(0x1400, 0x1000, 11, 4609);  // Pt100, 3 wires
    return map;
}

std::vector<RegisterMap> all_maps() {
    std::vector<RegisterMap> maps;
    maps.push_back({.name = "int16", .description = "16 channels, FC 3 and 4 from 0, int16 x 0.1 C"});
    maps.push_back(mb8art());
    maps.push_back({.name = "comwintop-8pt",
                    .description = "ComWinTop 8PT: 8 channels, FC 3 from 0, int16 x 0.1 C",
                    .input = false,
                    .most_channels = 8,
                    .constants = {}});
    maps.push_back(wb_mai11());
    maps.push_back({.name = "float32",
                    .description = "16 channels, FC 3 and 4 from 0, IEEE 754 float in C, two registers each",
                    .stride = 2,
                    .encoding = Encoding::float32,
                    .counts_per_C = 1.0,
                    .open_code = 0x7FC00000,
                    .short_code = 0xFFC00000,
                    .constants = {}});
    maps.push_back({.name = "int32",
                    .description = "16 channels, FC 3 and 4 from 0, int32 x 0.01 C, two registers each",
                    .stride = 2,
                    .encoding = Encoding::int32,
                    .counts_per_C = 100.0,
                    .open_code = 0x7FFFFFFF,
                    .short_code = 0x80000000,
                    .constants = {}});
    return maps;
}

std::uint32_t healthy_code(const RegisterMap& map, double value_C) {
    if (map.encoding == Encoding::float32) {
        return std::bit_cast<std::uint32_t>(static_cast<float>(value_C * map.counts_per_C));
    }
    const double largest = map.encoding == Encoding::int16 ? 32767.0 : 2147483647.0;
    const double counts = std::clamp(std::round(value_C * map.counts_per_C), -largest - 1.0, largest);
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(counts));
}

std::uint16_t swapped(std::uint16_t word) {
    return static_cast<std::uint16_t>((word << 8U) | (word >> 8U));
}

std::vector<std::uint16_t> two_words(std::uint32_t code, WordOrder order) {
    const auto high = static_cast<std::uint16_t>(code >> 16U);
    const auto low = static_cast<std::uint16_t>(code & 0xFFFFU);
    switch (order) {
        case WordOrder::abcd:
            return {high, low};
        case WordOrder::cdab:
            return {low, high};
        case WordOrder::badc:
            return {swapped(high), swapped(low)};
        case WordOrder::dcba:
            return {swapped(low), swapped(high)};
    }
    return {high, low};
}

}  // namespace

std::optional<RegisterMap::Place> RegisterMap::place(std::uint16_t address, std::size_t channels) const {
    if (address < first) return std::nullopt;
    const std::size_t offset = static_cast<std::size_t>(address) - first;
    const Place found{.channel = offset / stride, .word = static_cast<std::uint16_t>(offset % stride)};
    if (found.channel >= channels || found.word >= words_per_channel()) return std::nullopt;
    return found;
}

const std::vector<RegisterMap>& register_maps() {
    static const std::vector<RegisterMap> maps = all_maps();
    return maps;
}

std::optional<RegisterMap> find_register_map(std::string_view name) {
    for (const RegisterMap& map : register_maps()) {
        if (map.name == name) return map;
    }
    return std::nullopt;
}

std::optional<WordOrder> word_order_from_string(std::string_view name) {
    if (name == "abcd") return WordOrder::abcd;
    if (name == "cdab") return WordOrder::cdab;
    if (name == "badc") return WordOrder::badc;
    if (name == "dcba") return WordOrder::dcba;
    return std::nullopt;
}

std::vector<std::uint16_t> encode_channel(const RegisterMap& map, double value_C, SensorState state) {
    std::uint32_t code = map.open_code;
    if (state.kind == SensorState::shorted) code = map.short_code;
    if (state.kind == SensorState::as_coded) code = state.code;
    // A source without a value is a module without a sensor: there is no number to make up.
    if (state.kind == SensorState::healthy && std::isfinite(value_C)) code = healthy_code(map, value_C);
    if (map.encoding == Encoding::int16) return {static_cast<std::uint16_t>(code & 0xFFFFU)};
    return two_words(code, map.word_order);
}

}  // namespace thermbal
