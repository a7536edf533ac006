#include "store/records.hpp"

#include <array>
#include <utility>

namespace thermbal {

namespace {

constexpr std::array test_states = {
    std::pair{TestState::running, std::string_view("running")},
    std::pair{TestState::declared, std::string_view("declared")},
    std::pair{TestState::stopped, std::string_view("stopped")},
    std::pair{TestState::aborted, std::string_view("aborted")},
};

constexpr std::array scan_statuses = {
    std::pair{ScanStatus::ok, std::string_view("ok")},
    std::pair{ScanStatus::late, std::string_view("late")},
    std::pair{ScanStatus::repeated, std::string_view("repeated")},
    std::pair{ScanStatus::missed, std::string_view("missed")},
};

template <typename Table, typename Value>
std::string_view name_in(const Table& table, Value value) {
    for (const auto& [entry, name] : table)
        if (entry == value) return name;
    return "unknown";
}

}  // namespace

std::string_view to_string(TestState state) {
    return name_in(test_states, state);
}
std::string_view to_string(ScanStatus status) {
    return name_in(scan_statuses, status);
}

std::optional<TestState> test_state_from_string(std::string_view name) {
    for (const auto& [state, text] : test_states)
        if (text == name) return state;
    return std::nullopt;
}

std::optional<ScanStatus> scan_status_from_string(std::string_view name) {
    for (const auto& [status, text] : scan_statuses)
        if (text == name) return status;
    return std::nullopt;
}

}  // namespace thermbal
