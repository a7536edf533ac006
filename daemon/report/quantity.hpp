#pragma once

#include <string>

namespace thermbal {

/// A fitted number with its interval, as a person reads it: ("power_W", 41.02, 38.1, 43.9) is
/// "power 41 W (38.1 to 43.9)", and an onset in seconds is one in minutes. The unit is taken from the name.
std::string quantity_in_words(const std::string& name, double value, double low, double high);

}  // namespace thermbal
