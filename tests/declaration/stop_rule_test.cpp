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
    return verdict;
}

TEST(StopRule, StopsWhenEveryRequiredChannelIsDeclared) {
    const std::vector verdicts{channel("T2", ChannelState::declared), channel("T3", ChannelState::measuring),
                               channel("T4", ChannelState::barely_warming)};
    EXPECT_TRUE(decide_stop(verdicts, {true, false, true}).stop);
    const auto waits = decide_stop(verdicts, {true, true, true});
    EXPECT_FALSE(waits.stop);
    EXPECT_THAT(waits.waiting, ElementsAre("T3"));
}

TEST(StopRule, ARequiredChannelThatDoesNotMeasureHoldsTheTestAndIsNamed) {
    for (const ChannelState state : {ChannelState::stuck, ChannelState::dead}) {
        const std::vector verdicts{channel("T2", ChannelState::declared), channel("T3", state)};
        const auto held = decide_stop(verdicts, {true, true});
        EXPECT_FALSE(held.stop);
        EXPECT_THAT(held.reason, HasSubstr("T3 is " + std::string(to_string(state))));
        EXPECT_TRUE(decide_stop(verdicts, {true, false}).stop);
    }
}

TEST(StopRule, NothingWarmedIsNoReasonToStop) {
    EXPECT_FALSE(decide_stop(std::vector{channel("T2", ChannelState::barely_warming)}, {true}).stop);
    EXPECT_FALSE(decide_stop({}, {}).stop);
}

}  // namespace
}  // namespace thermbal
