#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace thermbal {

/// A test's life: idle -> running -> declared -> stopped, and aborted from running or declared. What is
/// stored is never idle.
enum class TestState : std::uint8_t { idle, running, declared, stopped, aborted };

enum class TestEvent : std::uint8_t {
    start,         ///< somebody starts a test
    all_declared,  ///< the stop rule holds: every required channel is declared
    stop,          ///< the stop has been carried out, or somebody stops the test
    abort,         ///< an alarm, the longest duration, or somebody ends it without a result
};

/// How a scan of the grid went.
enum class ScanStatus : std::uint8_t {
    ok,
    late,      ///< read, but began late behind the grid
    repeated,  ///< it took more than one attempt
    missed,    ///< not read at all: every sample is a gap
};

/// Stable names, as stored in SQLite and sent in JSON.
std::string_view to_string(TestState state);
std::string_view to_string(ScanStatus status);
std::optional<TestState> test_state_from_string(std::string_view name);
std::optional<ScanStatus> scan_status_from_string(std::string_view name);

/// The state after `event`; nullopt where the event means nothing in this state. Ended tests start anew.
std::optional<TestState> next_state(TestState state, TestEvent event);

constexpr bool is_measuring(TestState state) {
    return state == TestState::running || state == TestState::declared;
}

}  // namespace thermbal
