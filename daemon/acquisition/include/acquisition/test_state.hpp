#pragma once

#include <optional>
#include <string_view>

namespace thermbal {

/// A test's life: idle -> running -> declared -> stopped, and aborted from running or declared.
enum class TestState { idle, running, declared, stopped, aborted };

enum class TestEvent {
    start,         ///< somebody starts a test
    all_declared,  ///< the stop rule holds: every required channel is declared
    stop,          ///< the stop has been carried out, or somebody stops the test
    abort,         ///< an alarm, the longest duration, or somebody ends it without a result
};

std::string_view to_string(TestState state);
std::optional<TestState> test_state_from_string(std::string_view name);

/// The state after `event`; nullopt where the event means nothing in this state. Ended tests start anew.
std::optional<TestState> next_state(TestState state, TestEvent event);

constexpr bool is_measuring(TestState state) {
    return state == TestState::running || state == TestState::declared;
}

}  // namespace thermbal
