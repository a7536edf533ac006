#include "acquisition/alarm_watch.hpp"

#include <gmock/gmock.h>

namespace thermbal {
namespace {

using ::testing::HasSubstr;

Sample good(double value_C) {
    return {200U, value_C, Quality::good};
}

std::optional<Alarm> take(AlarmWatch& watch, int scan, std::vector<Sample> samples) {
    return watch.take(15.0 * scan, samples);
}

TEST(AlarmWatch, ALimitHoldsForSoManyGoodSamplesInARow) {
    AlarmWatch watch({{.name = "hot", .channel = 1, .above_C = 60.0, .scans = 3}}, 2);
    EXPECT_FALSE(take(watch, 0, {good(99.0), good(60.1)}));
    EXPECT_FALSE(take(watch, 1, {good(99.0), good(60.1)}));
    EXPECT_FALSE(take(watch, 2, {good(99.0), good(59.9)})) << "one below begins anew";
    EXPECT_FALSE(take(watch, 3, {good(99.0), good(60.1)}));
    EXPECT_FALSE(take(watch, 4, {good(99.0), Sample{.raw = {}, .quality = Quality::communication}}));
    EXPECT_FALSE(take(watch, 5, {good(99.0), good(60.2)})) << "silence neither raises nor ends a row";
    const auto alarm = take(watch, 6, {good(99.0), good(60.3)});
    ASSERT_TRUE(alarm);
    EXPECT_EQ(alarm->channel, 1U);
    EXPECT_THAT(alarm->reason, HasSubstr("60.30 C is above 60 C"));
    EXPECT_THAT(alarm->reason, HasSubstr("hot"));
}

TEST(AlarmWatch, ALimitOfEveryChannel) {
    AlarmWatch watch({{.name = "cold", .channel = {}, .below_C = 5.0, .scans = 1}}, 3);
    const auto alarm = take(watch, 0, {good(20.0), good(20.0), good(4.0)});
    ASSERT_TRUE(alarm);
    EXPECT_EQ(alarm->channel, 2U);
}

TEST(AlarmWatch, AFaultCodeIsNoTemperature) {
    AlarmWatch watch({{.name = "hot", .channel = {}, .above_C = 60.0, .scans = 1}}, 1);
    EXPECT_FALSE(take(watch, 0, {Sample{.raw = 32767U, .value_C = 3276.7, .quality = Quality::open}}));
}

TEST(AlarmWatch, ARateIsOverItsMinutesUpAndDown) {
    for (const double direction : {1.0, -1.0}) {
        AlarmWatch watch(
            {{.name = "fast", .channel = {}, .rate_C_per_min = 1.0, .rate_over_min = 2.0, .scans = 1}}, 1);
        std::optional<Alarm> alarm;
        int scan = 0;
        for (; scan < 100; ++scan) {
            EXPECT_FALSE(take(watch, scan, {good(20.0 + direction * 0.24 * scan)})) << "0.96 C/min";
        }
        const double at = 20.0 + direction * 0.24 * 99;
        int after = 0;
        for (; after < 20 && !alarm; ++after)
            alarm = take(watch, scan + after, {good(at + direction * 0.5 * (after + 1))});
        ASSERT_TRUE(alarm);
        EXPECT_LE(after, 8);
        EXPECT_THAT(alarm->reason, HasSubstr("more than 1 C/min"));
    }
}

TEST(AlarmWatch, AcrossAGapThereIsNoRate) {
    AlarmWatch watch(
        {{.name = "fast", .channel = {}, .rate_C_per_min = 0.1, .rate_over_min = 1.0, .scans = 1}}, 1);
    for (int scan = 0; scan < 10; ++scan) EXPECT_FALSE(take(watch, scan, {good(20.0)}));
    EXPECT_FALSE(take(watch, 400, {good(60.0)}));
    EXPECT_FALSE(take(watch, 401, {good(60.0)}));
}

}  // namespace
}  // namespace thermbal
