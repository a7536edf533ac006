#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "series/sample.hpp"

namespace thermbal {

enum class RegisterType : std::uint8_t { int16, uint16, int32, uint32, float32 };

/// How the four bytes of a 32-bit value lie in its two registers; A is the most significant byte. 16-bit
/// values know only "bytes swapped or not": abcd/cdab leave a register as it is, badc/dcba swap its two
/// bytes.
enum class ByteOrder : std::uint8_t { abcd, cdab, badc, dcba };

std::string_view to_string(RegisterType type);
std::optional<RegisterType> register_type_from_string(std::string_view name);
std::string_view to_string(ByteOrder order);
std::optional<ByteOrder> byte_order_from_string(std::string_view name);

/// A number, before scale and offset, by which the module says "this is not a temperature": first <= number
/// <= last.
struct FaultCode {
    double first = 0.0;
    double last = 0.0;
    Quality quality = Quality::open;
};

/// Where a module says which kind of sensor an input is set to.
struct TypeCode {
    int function = 3;
    int first_register = 0;     ///< of input 1
    int stride = 1;             ///< registers from one input to the next; 0: one code for all inputs
    std::vector<int> accepted;  ///< codes of the sensors that the profile reads rightly
};

/// The register map of one kind of temperature module: plain data, filled by the config room from TOML.
/// Registers are counted from 0, as they go over the wire. value_C = number * scale + offset_C.
struct ModuleProfile {
    std::string name;
    std::string source;      ///< where the facts come from: data sheet, page, file
    int function = 3;        ///< 3: holding registers, 4: input registers
    int first_register = 0;  ///< of input 1
    int inputs = 16;
    int stride = 1;  ///< registers from one input to the next; at least registers_per_value
    RegisterType type = RegisterType::int16;
    ByteOrder byte_order = ByteOrder::abcd;
    double scale = 0.1;
    double offset_C = 0.0;
    std::vector<FaultCode> faults;        ///< looked at in order, before anything else
    Quality nan_quality = Quality::open;  ///< what a float NaN means on this module
    double valid_min_C = -200.0;          ///< IEC 60751 unless the profile says less
    double valid_max_C = 850.0;
    std::optional<TypeCode> type_code = {};  ///< empty: the module has none, or it is not published
};

inline constexpr int max_registers_per_read = 125;

int registers_per_value(RegisterType type);

/// One sentence that names field, value and violated bound; empty when the profile can be used.
std::string check_profile(const ModuleProfile& profile);

/// One value from its registers (registers_per_value of them, in wire order). Sample::raw is the registers as
/// sent, the first one in the high half. Fault codes come first, then NaN and infinity, then the valid range;
/// only what passes all of them is good. Too few registers: Quality::communication. Never throws, never
/// invents.
Sample decode(const ModuleProfile& profile, std::span<const std::uint16_t> registers);

/// The inverse for a good value (for simulators and tests): the registers that decode to the nearest value_C.
std::vector<std::uint16_t> encode(const ModuleProfile& profile, double value_C);

}  // namespace thermbal
