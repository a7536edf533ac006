#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace thermbal {

enum class Encoding : std::uint8_t { int16, int32, float32 };
/// Order of the bytes of a 32-bit value in two registers; `a` is the most significant.
enum class WordOrder : std::uint8_t { abcd, cdab, badc, dcba };

/// What the module writes for a channel: a temperature, its code for a broken lead or a short, or `code` as
/// it is.
struct SensorState {
    enum Kind : std::uint8_t { healthy, open, shorted, as_coded };
    Kind kind = healthy;
    std::uint32_t code = 0;

    // NOLINTNEXTLINE(google-explicit-constructor): SensorState::open is a state
    constexpr SensorState(Kind of_kind = healthy) : kind(of_kind) {}
    static constexpr SensorState coded(std::uint32_t bits) {
        SensorState state(as_coded);
        state.code = bits;
        return state;
    }
    bool operator==(const SensorState&) const = default;
};

/// Where one kind of module keeps its temperatures, and how it writes them.
struct RegisterMap {
    std::string name;
    std::string description;
    bool holding = true;       ///< function code 3 reads the temperatures
    bool input = true;         ///< function code 4 reads the temperatures
    std::uint16_t first = 0;   ///< protocol address (from 0) of the first channel
    std::uint16_t stride = 1;  ///< registers from one channel to the next
    Encoding encoding = Encoding::int16;
    WordOrder word_order = WordOrder::abcd;
    double counts_per_C = 10.0;  ///< 1 for float
    std::uint32_t open_code = 0x7FFF;
    std::uint32_t short_code = 0x8000;
    std::size_t most_channels = 16;
    /// Further holding registers with a fixed content: type codes and the like.
    std::vector<std::pair<std::uint16_t, std::uint16_t>> constants = {};

    std::uint16_t words_per_channel() const { return encoding == Encoding::int16 ? 1 : 2; }
    /// Which channel (from 0) an address belongs to, and which of its words; nothing for other addresses.
    struct Place {
        std::size_t channel = 0;
        std::uint16_t word = 0;
    };
    std::optional<Place> place(std::uint16_t address, std::size_t channels) const;
};

const std::vector<RegisterMap>& register_maps();
std::optional<RegisterMap> find_register_map(std::string_view name);
std::optional<WordOrder> word_order_from_string(std::string_view name);

/// The registers of one channel, in the order of their addresses. A value outside the encoding's range is
/// clamped.
std::vector<std::uint16_t> encode_channel(const RegisterMap& map, double value_C, SensorState state);

}  // namespace thermbal
