#pragma once

namespace thermbal {

/// False for NaN.
inline bool within(double value, double lowest, double highest) {
    return value >= lowest && value <= highest;
}

}  // namespace thermbal
