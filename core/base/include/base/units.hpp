#pragma once

namespace thermbal {

inline constexpr double seconds_per_min = 60.0;

}  // namespace thermbal
