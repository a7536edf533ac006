#include "declaration/declarations.hpp"

#include <gtest/gtest.h>

#include "series/sample.hpp"

namespace thermbal {
namespace {

ChannelVerdict verdict(ChannelState state, double at_min, double low_C, double high_C) {
    ChannelVerdict made;
    made.channel = "T5";
    made.state = state;
    made.window_end_min = at_min;
    if (state == ChannelState::declared) made.declared_at_min = made.stands_since_min = at_min;
    made.tolerance_C = 0.2;
    made.steady_state_C = 0.5 * (low_C + high_C);
    made.steady_state_low_C = low_C;
    made.steady_state_high_C = high_C;
    return made;
}

ChannelVerdict in_a_room(double room_C, ChannelVerdict verdict) {
    verdict.room_C = room_C;
    return verdict;
}

/// 26.6 to 26.9 C.
Declarations declared_at_62(double room_C = no_value) {
    Declarations declarations;
    declarations.update({in_a_room(room_C, verdict(ChannelState::declared, 62, 26.6, 26.9))}, 0);
    return declarations;
}

TEST(Declarations, TheFirstDeclarationStandsWithItsFigures) {
    Declarations declarations;
    EXPECT_TRUE(declarations.update({verdict(ChannelState::measuring, 60, 25, 28)}, 0).empty());
    const auto changes = declarations.update({verdict(ChannelState::declared, 62, 26.6, 26.9)}, 0);
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_EQ(changes[0].kind, DeclarationChange::Kind::declared);
    EXPECT_TRUE(declarations.update({verdict(ChannelState::measuring, 64, 26.7, 26.95)}, 0).empty());
    EXPECT_TRUE(declarations.update({verdict(ChannelState::declared, 66, 26.7, 26.98)}, 0).empty());
    EXPECT_EQ(declarations.standing()[0].declared_at_min, 62);
    EXPECT_EQ(declarations.standing()[0].steady_state_low_C, 26.6);
    EXPECT_EQ(declarations.declared_channels(), std::set<std::string>{"T5"});
}

TEST(Declarations, ALaterWindowThatExcludesItWithdrawsIt) {
    Declarations declarations = declared_at_62();
    const auto changes = declarations.update({verdict(ChannelState::measuring, 80, 26.95, 27.2)}, 0);
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_EQ(changes[0].kind, DeclarationChange::Kind::withdrawn);
    EXPECT_EQ(declarations.standing()[0].state, ChannelState::measuring);
    EXPECT_TRUE(declarations.declared_channels().empty());
    const auto again = declarations.update({verdict(ChannelState::declared, 82, 26.95, 27.2)}, 0);
    ASSERT_EQ(again.size(), 1U);
    EXPECT_EQ(again[0].kind, DeclarationChange::Kind::declared);
}

TEST(Declarations, FiguresThatALaterWindowKnowsBetterAreRenewed) {
    Declarations declarations;
    auto first = verdict(ChannelState::declared, 62, 26.6, 26.9);
    first.guards = {{"interval_within_tolerance", true, "then"}, {"clear_minimum", true, "at n = 7"}};
    first.n = 7;
    declarations.update({first}, 0);
    auto later = verdict(ChannelState::declared, 80, 26.88, 27.08);
    later.guards = {{"interval_within_tolerance", true, "now"}};
    const auto changes = declarations.update({later}, 0);
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_EQ(changes[0].kind, DeclarationChange::Kind::renewed);
    EXPECT_EQ(changes[0].reason,
              "26.60 to 26.90 C was declared at 62.0 min, 26.88 to 27.08 C is known at 80.0 min");
    const ChannelVerdict& standing = declarations.standing()[0];
    EXPECT_TRUE(standing.declared());
    EXPECT_EQ(standing.steady_state_C, later.steady_state_C);
    EXPECT_EQ(standing.declared_at_min, 80) << "its figures come from the window of 80 min";
    EXPECT_EQ(standing.stands_since_min, 62);
    EXPECT_EQ(standing.n, 7) << "the sweep was not asked again";
    ASSERT_EQ(standing.guards.size(), 2U);
    EXPECT_EQ(standing.guards[0].figures, "now");
    EXPECT_EQ(standing.guards[1].figures, "at n = 7");
}

TEST(Declarations, WhatIsKnownBetterButNotDeclarableIsMeasuredOn) {
    Declarations declarations = declared_at_62();
    const auto changes = declarations.update({verdict(ChannelState::measuring, 80, 26.88, 27.08)}, 0);
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_EQ(changes[0].kind, DeclarationChange::Kind::withdrawn);
}

TEST(Declarations, NothingIsRenewedForLittleOrForWhatIsItselfNotKnown) {
    Declarations declarations = declared_at_62();
    EXPECT_TRUE(declarations.update({verdict(ChannelState::declared, 80, 26.85, 26.95)}, 0).empty())
        << "0.15 C is within the tolerance";
    EXPECT_TRUE(declarations.update({verdict(ChannelState::measuring, 80, 26.74, 27.3)}, 0).empty())
        << "an interval beyond the tolerance knows nothing better";
}

TEST(Declarations, ARoomThatHasMovedIsNoFaultOfADeclaration) {
    Declarations declarations = declared_at_62(21.0);
    const auto later = verdict(ChannelState::declared, 80, 26.88, 27.08);
    EXPECT_TRUE(declarations.update({in_a_room(21.15, later)}, 0).empty());
    EXPECT_EQ(declarations.update({in_a_room(21.0, later)}, 0)[0].kind, DeclarationChange::Kind::renewed);
}

TEST(Declarations, WhatIsApartOnlyByTheRoomStands) {
    Declarations declarations = declared_at_62(21.0);
    const auto later = verdict(ChannelState::measuring, 80, 27.0, 27.8);
    EXPECT_TRUE(declarations.update({in_a_room(21.6, later)}, 0).empty());
    EXPECT_EQ(declarations.update({in_a_room(21.0, later)}, 0)[0].kind, DeclarationChange::Kind::withdrawn);
}

TEST(Declarations, WhatATestWasStoppedOnIsNotRenewed) {
    Declarations declarations = declared_at_62();
    const auto better = verdict(ChannelState::declared, 80, 26.88, 27.08);
    EXPECT_TRUE(declarations.update({better}, 0, Renewals::over).empty());
    EXPECT_EQ(declarations.standing()[0].steady_state_C, 26.75);
}

TEST(Declarations, ARegimeThatBeganAfterItWithdrawsIt) {
    Declarations declarations = declared_at_62();
    EXPECT_TRUE(declarations.update({verdict(ChannelState::measuring, 90, 26.6, 26.9)}, 60).empty());
    EXPECT_EQ(declarations.update({verdict(ChannelState::measuring, 92, 26.6, 26.9)}, 91).size(), 1U);
}

TEST(Declarations, ASensorThatDiesAfterItsDeclarationDoesNotUndoIt) {
    Declarations declarations = declared_at_62();
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
