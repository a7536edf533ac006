#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace thermbal {

/// The outcome of a named predicate: what it decided, and on which figures.
struct Guard {
    std::string name;  ///< "enough_samples", "clear_minimum", ...
    bool passed = false;
    std::string figures;  ///< for a person: "half width 0.31 C, needed 0.20 C"
};

/// The first guard that did not pass; nullptr when all did.
inline const Guard* first_failed(const std::vector<Guard>& guards) {
    for (const Guard& guard : guards) {
        if (!guard.passed) return &guard;
    }
    return nullptr;
}

}  // namespace thermbal
