#include "acquisition/time_watch.hpp"

#include <gmock/gmock.h>

#include "acquisition/clock.hpp"

namespace thermbal {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t s = 1'000'000'000;
constexpr std::int64_t ms = 1'000'000;

/// A host whose clocks do what a test says.
struct Host {
    ClockReading now{1000 * s, 900 * s, 1'700'000'000 * s};

    ClockReading pass(std::int64_t ns) {
        now.boot_ns += ns;
        now.awake_ns += ns;
        now.wall_ns += ns;
        return now;
    }
};

TEST(TimeWatch, OrdinaryTimeSaysNothing) {
    Host host;
    TimeWatch watch;
    for (int scan = 0; scan < 1000; ++scan) {
        host.now.wall_ns += scan % 2 == 0 ? 7 * ms : -7 * ms;  // a time server slews
        EXPECT_THAT(watch.take_clocks(host.pass(15 * s)), IsEmpty());
    }
}

TEST(TimeWatch, AStepOfTheWallClockIsToldOnceWithItsSize) {
    for (const std::int64_t step : {3600 * s, -3600 * s, 2 * s, -2 * s}) {
        Host host;
        TimeWatch watch;
        watch.take_clocks(host.pass(15 * s));
        host.now.wall_ns += step;
        const auto events = watch.take_clocks(host.pass(15 * s));
        ASSERT_EQ(events.size(), 1U) << step;
        EXPECT_EQ(events[0].kind, "clock_step");
        EXPECT_THAT(events[0].message, HasSubstr(step > 0 ? "forward" : "back"));
        EXPECT_THAT(events[0].message, HasSubstr(step == 2 * s || step == -2 * s ? "2.0 s" : "3600.0 s"));
        EXPECT_THAT(watch.take_clocks(host.pass(15 * s)), IsEmpty());
    }
}

TEST(TimeWatch, ASuspendIsTheDifferenceOfTheTwoMonotonicClocks) {
    Host host;
    TimeWatch watch;
    watch.take_clocks(host.pass(15 * s));
    host.now.boot_ns += 600 * s;
    host.now.wall_ns += 600 * s;
    const auto events = watch.take_clocks(host.pass(15 * s));
    ASSERT_EQ(events.size(), 1U);
    EXPECT_EQ(events[0].kind, "suspended");
    EXPECT_THAT(events[0].message, HasSubstr("600.0 s"));
}

TEST(TimeWatch, ASuspendWithAClockThatWasNotSetMeanwhileIsBoth) {
    Host host;
    TimeWatch watch;
    watch.take_clocks(host.pass(15 * s));
    host.now.boot_ns += 600 * s;
    EXPECT_EQ(watch.take_clocks(host.pass(15 * s)).size(), 2U);
}

Scan scan_of(std::int64_t number, ScanStatus status) {
    Scan scan;
    scan.scan = number;
    scan.status = status;
    scan.due_ns = number * 15 * s;
    scan.started_ns = scan.due_ns + (status == ScanStatus::late ? 4 * s : 0);
    return scan;
}

TEST(TimeWatch, LateAndMissedScansAreToldWhenTheyBeginAndWhenTheyEnd) {
    TimeWatch watch;
    EXPECT_FALSE(watch.take_scan(scan_of(0, ScanStatus::ok)));
    const auto late = watch.take_scan(scan_of(1, ScanStatus::late));
    ASSERT_TRUE(late);
    EXPECT_EQ(late->kind, "scans_late");
    EXPECT_THAT(late->message, HasSubstr("scan 1 was read 4.00 s late"));
    EXPECT_FALSE(watch.take_scan(scan_of(2, ScanStatus::late)));
    const auto missed = watch.take_scan(scan_of(3, ScanStatus::missed));
    ASSERT_TRUE(missed);
    EXPECT_EQ(missed->kind, "scans_missed");
    EXPECT_FALSE(watch.take_scan(scan_of(4, ScanStatus::missed)));
    EXPECT_FALSE(watch.take_scan(scan_of(5, ScanStatus::late)));
    for (int scan = 6; scan < 9; ++scan) EXPECT_FALSE(watch.take_scan(scan_of(scan, ScanStatus::ok)));
    const auto over = watch.take_scan(scan_of(9, ScanStatus::repeated));
    ASSERT_TRUE(over);
    EXPECT_EQ(over->kind, "on_time");
    EXPECT_THAT(over->message, HasSubstr("after 5 that were not, from scan 1 on"));
    EXPECT_FALSE(watch.take_scan(scan_of(10, ScanStatus::ok)));
}

TEST(TimeWatch, TheSystemsOwnClocksAgreeWithThemselves) {
    const auto clock = system_clock();
    TimeWatch watch;
    for (int i = 0; i < 20; ++i) EXPECT_THAT(watch.take_clocks(clock->read()), IsEmpty());
}

}  // namespace
}  // namespace thermbal
