#include "manual/flags.hpp"

#include <fmt/format.h>

namespace thermbal {

CLI::Validator number_in(double low, double high) {
    const auto check = [low, high](const std::string& text) {
        double value = 0.0;
        if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return std::string();
        return fmt::format("Value {} not in range {} to {}", text, low, high);
    };
    return {check, fmt::format("FLOAT in [{} - {}]", low, high)};
}

}  // namespace thermbal
