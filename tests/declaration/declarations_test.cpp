#include "declaration/declarations.hpp"

#include <gtest/gtest.h>

namespace thermbal {
namespace {

ChannelVerdict verdict(ChannelState state, double at_min, double low_C, double high_C) {
    ChannelVerdict made;
    made.channel = "T5";
    made.state = state;
    made.window_end_min = at_min;
    if (state == ChannelState::declared) made.declared_at_min = at_min;
    made.steady_state_C = 0.5 * (low_C + high_C);
    made.steady_state_low_C = low_C;
    made.steady_state_high_C = high_C;
    return made;
}

TEST(Declarations, TheFirstDeclarationStandsWithItsFigures) {
    Declarations declarations;
    EXPECT_TRUE(declarations.update({verdict(ChannelState::measuring, 60, 25, 28)}, 0).empty());
    const auto changes = declarations.update({verdict(ChannelState::declared, 62, 26.6, 26.9)}, 0);
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_EQ(changes[0].kind, DeclarationChange::Kind::declared);
    EXPECT_TRUE(declarations.update({verdict(ChannelState::measuring, 64, 26.7, 26.95)}, 0).empty());
    EXPECT_TRUE(declarations.update({verdict(ChannelState::declared, 66, 26.8, 27.0)}, 0).empty());
    EXPECT_EQ(declarations.standing()[0].declared_at_min, 62);
    EXPECT_EQ(declarations.standing()[0].steady_state_low_C, 26.6);
    EXPECT_EQ(declarations.declared_channels(), std::set<std::string>{"T5"});
}

TEST(Declarations, ALaterWindowThatExcludesItWithdrawsIt) {
    Declarations declarations;
    declarations.update({verdict(ChannelState::declared, 62, 26.6, 26.9)}, 0);
    const auto changes = declarations.update({verdict(ChannelState::declared, 80, 26.95, 27.2)}, 0);
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_EQ(changes[0].kind, DeclarationChange::Kind::withdrawn);
    EXPECT_EQ(declarations.standing()[0].state, ChannelState::measuring);
    EXPECT_TRUE(declarations.declared_channels().empty());
    const auto again = declarations.update({verdict(ChannelState::declared, 82, 26.95, 27.2)}, 0);
    ASSERT_EQ(again.size(), 1U);
    EXPECT_EQ(again[0].kind, DeclarationChange::Kind::declared);
}

TEST(Declarations, ARegimeThatBeganAfterItWithdrawsIt) {
    Declarations declarations;
    declarations.update({verdict(ChannelState::declared, 62, 26.6, 26.9)}, 0);
    EXPECT_TRUE(declarations.update({verdict(ChannelState::measuring, 90, 26.6, 26.9)}, 60).empty());
    EXPECT_EQ(declarations.update({verdict(ChannelState::measuring, 92, 26.6, 26.9)}, 91).size(), 1U);
}

TEST(Declarations, ASensorThatDiesAfterItsDeclarationDoesNotUndoIt) {
    Declarations declarations;
    declarations.update({verdict(ChannelState::declared, 62, 26.6, 26.9)}, 0);
    EXPECT_TRUE(declarations.update({verdict(ChannelState::dead, 80, 0, 0)}, 0).empty());
    EXPECT_TRUE(declarations.standing()[0].declared());
}

TEST(Declarations, WhatAnEarlierLifeDeclaredStands) {
    Declarations declarations;
    declarations.restore({verdict(ChannelState::declared, 62, 26.6, 26.9)});
    EXPECT_TRUE(declarations.update({verdict(ChannelState::declared, 80, 26.7, 26.9)}, 0).empty());
    EXPECT_EQ(declarations.standing()[0].declared_at_min, 62);
}

}  // namespace
}  // namespace thermbal
