#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

namespace thermbal {

/// Where a sample's value stands. Only `good` carries a temperature; every other sample has value_C = NaN.
enum class Quality : std::uint8_t {
    good,
    open,           ///< the module reports a broken sensor or lead
    shorted,        ///< the module reports a shorted sensor
    over_range,     ///< above what the module, or the profile's valid range, allows
    under_range,    ///< below it
    stuck,          ///< the module answers, its words do not change any more
    stale,          ///< the module says the value is not from this cycle
    communication,  ///< no trustworthy answer for this scan
    gap,            ///< nothing was asked: the daemon, the host or the grid missed this scan
};

/// Stable names, as stored in SQLite and sent in JSON.
std::string_view to_string(Quality quality);
std::optional<Quality> quality_from_string(std::string_view name);

inline constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

/// Of those that are values; no_value when none is.
double mean_of_good(std::span<const double> values);
double first_good(std::span<const double> values);
double last_good(std::span<const double> values);

/// One channel at one scan. `raw` is the register as the module sent it (16 or 32 bits, sign not applied);
/// empty when the module did not answer. `source_C` is what the module said where a calibration has made
/// value_C of it; NaN where value_C is what the module said.
struct Sample {
    std::optional<std::uint32_t> raw;
    double value_C = no_value;
    Quality quality = Quality::gap;
    double source_C = no_value;

    bool good() const { return quality == Quality::good && std::isfinite(value_C); }
};

}  // namespace thermbal
