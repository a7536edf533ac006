#include "gap/agreement.hpp"

#include <algorithm>

#include <gmock/gmock.h>

#include "small_machine.hpp"

namespace thermbal {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

Model with_cutting_heat(double power_W) {
    Model model = small_machine();
    model.effects.push_back(
        {"cutting_heat", "", "housing", {{"power_W", power_W, 0.0}, {"onset_s", 6000.0, 0.0}}, {}});
    return model;
}

std::vector<std::string> disagreeing(const std::vector<ChannelAgreement>& channels) {
    std::vector<std::string> names;
    for (const ChannelAgreement& one : channels) {
        if (one.disagrees) names.push_back(one.channel);
    }
    return names;
}

TEST(Agreement, ATestThatTheModelCanBeAgrees) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
        const auto found =
            check_agreement(small_machine(), measured_on(small_machine(), 200.0, 0.05, seed), {});
        ASSERT_TRUE(found);
        ASSERT_THAT(*found, SizeIs(3));
        EXPECT_THAT(disagreeing(*found), IsEmpty()) << seed;
    }
}

TEST(Agreement, NumbersThatTheModelLeavesOpenAreNoDisagreement) {
    Model truth = small_machine();
    truth.sources.front().power_W.value *= 1.2;  // known to 20 %: 8 C more at the bearing
    truth.links[2].conductance_W_per_K.value *= 0.85;
    const auto found = check_agreement(small_machine(), measured_on(truth, 200.0, 0.05, 1), {});
    ASSERT_TRUE(found);
    EXPECT_THAT(disagreeing(*found), IsEmpty());
    Model sure = small_machine();
    sure.relative_sigma = 0.0;
    sure.sources.front().power_W.relative_sigma = 0.0;
    for (ThermalLink& link : sure.links) link.conductance_W_per_K.relative_sigma = 0.0;
    const auto apart = check_agreement(sure, measured_on(truth, 200.0, 0.05, 1), {});
    ASSERT_TRUE(apart);
    EXPECT_THAT(disagreeing(*apart), SizeIs(3));
}

TEST(Agreement, HeatThatTheModelLacksDisagreesWhereAndWhenItIs) {
    const auto found =
        check_agreement(small_machine(), measured_on(with_cutting_heat(40.0), 200.0, 0.05, 1), {});
    ASSERT_TRUE(found);
    const auto worst = std::ranges::max_element(*found, {}, &ChannelAgreement::sigmas);
    ASSERT_TRUE(worst->disagrees);
    EXPECT_GT(worst->sigmas, 4.0);
    EXPECT_GE(worst->to_s - worst->from_s, 600.0);
    EXPECT_LE(worst->to_s, 200.0 * 60.0);
}

TEST(Agreement, ItTakesMoreToBeginThanToGoOn) {
    const RecordedTest test = measured_on(with_cutting_heat(40.0), 200.0, 0.05, 1);
    const auto found = check_agreement(small_machine(), test, {});
    ASSERT_TRUE(found);
    const auto worst = std::ranges::max_element(*found, {}, &ChannelAgreement::sigmas);
    AgreementOptions stricter;
    stricter.begins_sigmas = worst->sigmas * 1.1;
    stricter.ends_sigmas = worst->sigmas * 0.9;
    const auto fresh = check_agreement(small_machine(), test, {}, stricter);
    ASSERT_TRUE(fresh);
    EXPECT_THAT(disagreeing(*fresh), IsEmpty());
    const std::vector<std::string> before = {worst->channel};
    const auto kept = check_agreement(small_machine(), test, before, stricter);
    ASSERT_TRUE(kept);
    EXPECT_EQ(disagreeing(*kept), before);
}

TEST(Agreement, AShortTestSaysNothing) {
    const auto found =
        check_agreement(small_machine(), measured_on(with_cutting_heat(40.0), 10.0, 0.05, 1), {});
    ASSERT_TRUE(found);
    EXPECT_THAT(*found, IsEmpty());
}

TEST(Agreement, ACancelledCheckEndsWithTheSimulationUnderWay) {
    int looks = 0;
    const auto found = check_agreement(small_machine(), measured_on(small_machine(), 60.0, 0.05, 1), {}, {},
                                       [&looks] { return ++looks >= 3; });
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().next, NextStep::stop);
    // The first sensitivities, all of them but two given up.
    EXPECT_LT(looks, 40);
}

TEST(Agreement, ATestWithoutAnySensorOfTheModelIsRefused) {
    RecordedTest test = measured_on(small_machine(), 60.0, 0.05, 1);
    for (Column& channel : test.channels) channel.name += "9";
    EXPECT_FALSE(check_agreement(small_machine(), test, {}));
}

}  // namespace
}  // namespace thermbal
