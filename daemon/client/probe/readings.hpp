#pragma once

#include <cstdint>
#include <vector>

#include "modbus/profile.hpp"

namespace thermbal {

/// Registers that a unit gave in one reply.
struct RegisterBlock {
    int function = 3;
    int first = 0;
    std::vector<std::uint16_t> words;
};

/// One way of reading some of the registers as temperatures.
struct Reading {
    ModuleProfile profile;       ///< function, first register, inputs, type, byte order, scale
    bool is_resistance = false;  ///< number * scale is ohms of a PT100; no profile can be made of that
    std::vector<double>
        values_C;        ///< one an input; NaN where the word is a usual fault code or no temperature
    double score = 0.0;  ///< how much speaks for it; 0: nothing
};

/// Every reading of the block that can be temperatures of a machine hall (-30 to 120 C), best first: int16
/// and uint16 by tenths, hundredths and whole degrees, 32-bit integers by tenths to thousandths and floats in
/// four orders of bytes, and resistances through IEC 60751. A guess: the manual of the module decides. At
/// most `most` of them.
std::vector<Reading> rank_readings(const RegisterBlock& block, std::size_t most);

/// The share of its inputs that a known profile reads as temperatures of a hall or as one of its fault codes,
/// by the registers of its blocks in order; 0 when not one is a temperature.
double fit_of(const ModuleProfile& profile, const std::vector<Sample>& samples);

}  // namespace thermbal
