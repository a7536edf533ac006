#include "declaration/stop_rule.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace thermbal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

ChannelVerdict channel(std::string name, ChannelState state) {
    ChannelVerdict verdict;
    verdict.channel = std::move(name);
    verdict.state = state;
    if (state == ChannelState::declared) verdict.declared_at_min = verdict.stands_since_min = 62.0;
    return verdict;
}

TEST(StopRule, StopsWhenEveryRequiredChannelIsDeclared) {
    const std::vector verdicts{channel("T2", ChannelState::declared), channel("T3", ChannelState::measuring),
                               channel("T4", ChannelState::barely_warming)};
    EXPECT_TRUE(decide_stop(verdicts, {true, false, true}, 90.0).stop);
    const auto waits = decide_stop(verdicts, {true, true, true}, 90.0);
    EXPECT_FALSE(waits.stop);
    EXPECT_THAT(waits.waiting, ElementsAre("T3"));
}

TEST(StopRule, TheLastDeclarationHasToStandForAWhile) {
    std::vector verdicts{channel("T2", ChannelState::declared), channel("T3", ChannelState::declared)};
    verdicts[1].stands_since_min = 84.0;
    const auto watched = decide_stop(verdicts, {true, true}, 91.75);
    EXPECT_FALSE(watched.stop);
    EXPECT_THAT(watched.reason, HasSubstr("T3, the last of them, is watched until 92.0 min"));
    EXPECT_TRUE(watched.waiting.empty());
    EXPECT_TRUE(decide_stop(verdicts, {true, true}, 92.0).stop);
    EXPECT_TRUE(decide_stop(verdicts, {true, false}, 84.0).stop) << "T3 is not required";
    verdicts[1].declared_at_min = 91.0;  // its figures were renewed: it has been declared all the same
    EXPECT_TRUE(decide_stop(verdicts, {true, true}, 92.0).stop);
}

TEST(StopRule, ARequiredChannelThatDoesNotMeasureHoldsTheTestAndIsNamed) {
    for (const ChannelState state : {ChannelState::stuck, ChannelState::dead}) {
        const std::vector verdicts{channel("T2", ChannelState::declared), channel("T3", state)};
        const auto held = decide_stop(verdicts, {true, true}, 90.0);
        EXPECT_FALSE(held.stop);
        EXPECT_TRUE(held.held);
        EXPECT_THAT(held.reason, HasSubstr("T3 is " + std::string(to_string(state))));
        EXPECT_TRUE(decide_stop(verdicts, {true, false}, 90.0).stop);
        const std::vector early{channel("T2", ChannelState::measuring), channel("T3", state)};
        EXPECT_FALSE(decide_stop(early, {true, true}, 90.0).held) << "T2 is waited for as well";
    }
}

TEST(StopRule, NothingWarmedIsNoReasonToStop) {
    EXPECT_FALSE(decide_stop(std::vector{channel("T2", ChannelState::barely_warming)}, {true}, 90.0).stop);
    EXPECT_FALSE(decide_stop({}, {}, 90.0).stop);
}

}  // namespace
}  // namespace thermbal
