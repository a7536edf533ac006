#pragma once

namespace thermbal {

/// What a reading can be. Instruments mark "no reading" with numbers outside: -9999, -999.9, 32767, 1e308.
inline constexpr double absolute_zero_C = -273.15;
inline constexpr double hottest_reading_C = 3000.0;

/// NaN is none.
constexpr bool is_temperature(double value_C) {
    return value_C >= absolute_zero_C && value_C <= hottest_reading_C;
}

}  // namespace thermbal
