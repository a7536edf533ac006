#include "series/test_state.hpp"

#include <gtest/gtest.h>

namespace thermbal {
namespace {

TEST(TestState, TheWholeLife) {
    EXPECT_EQ(next_state(TestState::idle, TestEvent::start), TestState::running);
    EXPECT_EQ(next_state(TestState::running, TestEvent::all_declared), TestState::declared);
    EXPECT_EQ(next_state(TestState::declared, TestEvent::stop), TestState::stopped);
    EXPECT_EQ(next_state(TestState::running, TestEvent::abort), TestState::aborted);
    EXPECT_EQ(next_state(TestState::aborted, TestEvent::start), TestState::running);
}

TEST(TestState, WhatMeansNothingChangesNothing) {
    EXPECT_FALSE(next_state(TestState::idle, TestEvent::stop));
    EXPECT_FALSE(next_state(TestState::running, TestEvent::start));
    EXPECT_FALSE(next_state(TestState::declared, TestEvent::all_declared));
    EXPECT_FALSE(next_state(TestState::stopped, TestEvent::abort));
    EXPECT_FALSE(next_state(TestState::idle, TestEvent::all_declared));
}

TEST(TestState, NamesReadBack) {
    for (const TestState state :
         {TestState::idle, TestState::running, TestState::declared, TestState::stopped, TestState::aborted}) {
        EXPECT_EQ(test_state_from_string(to_string(state)), state);
    }
    EXPECT_FALSE(test_state_from_string("paused"));
}

}  // namespace
}  // namespace thermbal
