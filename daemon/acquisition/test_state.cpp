#include "acquisition/test_state.hpp"

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

}  // namespace

std::string_view to_string(TestState state) {
    for (const auto& [value, name] : state_names) {
        if (value == state) return name;
    }
    return "idle";
}

std::optional<TestState> test_state_from_string(std::string_view name) {
    for (const auto& [value, known] : state_names) {
        if (known == name) return value;
    }
    return std::nullopt;
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
