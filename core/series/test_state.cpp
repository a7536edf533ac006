#include "series/test_state.hpp"

#include <array>
#include <utility>

namespace thermbal {
namespace {

constexpr std::array<std::pair<TestState, std::string_view>, 5> state_names{{
    {TestState::idle, "idle"},
    {TestState::running, "running"},
    {TestState::declared, "declared"},
    {TestState::stopped, "stopped"},
    {TestState::aborted, "aborted"},
}};

constexpr std::array<std::pair<ScanStatus, std::string_view>, 4> scan_status_names{{
    {ScanStatus::ok, "ok"},
    {ScanStatus::late, "late"},
    {ScanStatus::repeated, "repeated"},
    {ScanStatus::missed, "missed"},
}};

template <typename Table, typename Value>
std::string_view name_in(const Table& table, Value value) {
    for (const auto& [entry, name] : table) {
        if (entry == value) return name;
    }
    return "unknown";
}

template <typename Value, typename Table>
std::optional<Value> value_in(const Table& table, std::string_view name) {
    for (const auto& [value, entry] : table) {
        if (entry == name) return value;
    }
    return std::nullopt;
}

}  // namespace

std::string_view to_string(TestState state) {
    return name_in(state_names, state);
}
std::string_view to_string(ScanStatus status) {
    return name_in(scan_status_names, status);
}

std::optional<TestState> test_state_from_string(std::string_view name) {
    return value_in<TestState>(state_names, name);
}

std::optional<ScanStatus> scan_status_from_string(std::string_view name) {
    return value_in<ScanStatus>(scan_status_names, name);
}

std::optional<TestState> next_state(TestState state, TestEvent event) {
    switch (event) {
        case TestEvent::start:
            if (!is_measuring(state)) return TestState::running;
            break;
        case TestEvent::all_declared:
            if (state == TestState::running) return TestState::declared;
            break;
        case TestEvent::stop:
            if (is_measuring(state)) return TestState::stopped;
            break;
        case TestEvent::abort:
            if (is_measuring(state)) return TestState::aborted;
            break;
    }
    return std::nullopt;
}

}  // namespace thermbal
