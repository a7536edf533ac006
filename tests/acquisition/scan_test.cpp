#include "acquisition/scan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace thermbal {
namespace {

constexpr std::int64_t s = 1'000'000'000;
const Grid grid{.start_ns = 100 * s, .period_ns = 15 * s};

LineScan reading(std::size_t line, std::int64_t scan, std::vector<std::size_t> channels,
                 std::int64_t started_ns) {
    LineScan result{line, 1, scan, started_ns, started_ns + s / 10, started_ns + 1000 * s, {}};
    for (const std::size_t channel : channels) {
        result.samples.push_back({channel, Sample{200U, 20.0, Quality::good}});
    }
    return result;
}

TEST(Grid, DoesNotDrift) {
    EXPECT_EQ(grid.due_ns(1'000'000), 100 * s + 15'000'000 * s);
    EXPECT_EQ(grid.scan_at(100 * s - 1), -1);
    EXPECT_EQ(grid.scan_at(100 * s), 0);
    EXPECT_EQ(grid.scan_at(grid.due_ns(7) - 1), 6);
    EXPECT_EQ(grid.time_s(122), 1830.0) << "whole seconds are whole";
}

TEST(ScanAssembler, ClosesAScanWhenEveryLineHasReadIt) {
    ScanAssembler assembler(grid, 1, 0, {0, 0, 1}, 2);
    assembler.add(reading(0, 0, {0, 1}, 100 * s));
    EXPECT_TRUE(assembler.take_closed(101 * s, 1101 * s).empty());
    assembler.add(reading(1, 0, {2}, 101 * s));
    const auto closed = assembler.take_closed(101 * s, 1101 * s);
    ASSERT_EQ(closed.size(), 1U);
    EXPECT_EQ(closed[0].status, ScanStatus::ok);
    EXPECT_EQ(closed[0].started_ns, 100 * s);
    for (const Sample& sample : closed[0].samples) EXPECT_TRUE(sample.good());
}

TEST(ScanAssembler, ASilentLineLeavesCommunicationSamplesAndDoesNotHoldTheOthers) {
    ScanAssembler assembler(grid, 1, 0, {0, 1}, 2);
    assembler.add(reading(0, 0, {0}, 100 * s));
    EXPECT_TRUE(assembler.take_closed(115 * s - 1, 0).empty());
    const auto closed = assembler.take_closed(115 * s, 1115 * s);
    ASSERT_EQ(closed.size(), 1U);
    EXPECT_TRUE(closed[0].samples[0].good());
    EXPECT_EQ(closed[0].samples[1].quality, Quality::communication);
}

TEST(ScanAssembler, SkippedScansAreMissedRowsInOrder) {
    ScanAssembler assembler(grid, 1, 3, {0}, 1);
    assembler.add(reading(0, 6, {0}, grid.due_ns(6)));
    const auto closed = assembler.take_closed(grid.due_ns(6) + 1, 2000 * s);
    ASSERT_EQ(closed.size(), 4U);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(closed[i].scan, static_cast<std::int64_t>(3 + i));
        EXPECT_EQ(closed[i].status, ScanStatus::missed);
        EXPECT_EQ(closed[i].samples[0].quality, Quality::gap);
        EXPECT_FALSE(closed[i].samples[0].raw);
    }
    EXPECT_EQ(closed[0].wall_ns, 2000 * s - 45 * s - 1);
    EXPECT_EQ(closed[3].status, ScanStatus::ok);
}

TEST(ScanAssembler, AfterALongStandstillTheOldestComeFirst) {
    ScanAssembler assembler(grid, 1, 0, {0}, 1);
    const std::int64_t now_ns = grid.due_ns(1'000'000);
    for (std::int64_t first = 0; first < 9; first += 3) {
        const auto closed = assembler.take_closed(now_ns, now_ns, 3);
        ASSERT_EQ(closed.size(), 3U);
        EXPECT_EQ(closed.front().scan, first);
        EXPECT_EQ(closed.back().scan, first + 2);
    }
}

TEST(ScanAssembler, LateRepeatedForeignAndClosedReadings) {
    ScanAssembler assembler(grid, 1, 0, {0}, 1);
    assembler.add(reading(0, 0, {0}, grid.due_ns(0) + 2 * s));
    assembler.add(reading(0, 0, {0}, grid.due_ns(0) + 3 * s));
    LineScan foreign = reading(0, 1, {0}, grid.due_ns(1));
    foreign.generation = 2;
    assembler.add(foreign);
    const auto closed = assembler.take_closed(grid.due_ns(0) + 4 * s, 0);
    ASSERT_EQ(closed.size(), 1U);
    EXPECT_EQ(closed[0].status, ScanStatus::late);
    EXPECT_EQ(closed[0].started_ns, grid.due_ns(0) + 2 * s);
    assembler.add(reading(0, 0, {0}, grid.due_ns(0)));
    EXPECT_TRUE(assembler.take_closed(grid.due_ns(0) + 5 * s, 0).empty());
}

}  // namespace
}  // namespace thermbal
