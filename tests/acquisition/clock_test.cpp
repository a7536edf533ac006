#include "acquisition/clock.hpp"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>
#include <time.h>

namespace thermbal {
namespace {

constexpr std::int64_t s = 1'000'000'000;

TEST(SystemClock, SleepsUntilTheDeadlineAndNotLess) {
    const auto clock = system_clock();
    const std::int64_t deadline = clock->monotonic_ns() + s / 20;
    EXPECT_TRUE(clock->sleep_until(deadline, clock->wakes(), {}));
    EXPECT_GE(clock->monotonic_ns(), deadline);
}

TEST(SystemClock, AWakeBeforeTheSleepIsNotLost) {
    const auto clock = system_clock();
    const std::uint64_t seen = clock->wakes();
    clock->wake();
    EXPECT_FALSE(clock->sleep_until(clock->monotonic_ns() + 3600 * s, seen, {}));
}

TEST(ScaledClock, TwoWithTheSameEpochAgreeAndRunFaster) {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    const std::int64_t epoch = now.tv_sec * s + now.tv_nsec;
    const auto one = scaled_clock(1000.0, epoch);
    const auto other = scaled_clock(1000.0, epoch);
    const std::int64_t deadline = 15 * s;
    const auto real_start = std::chrono::steady_clock::now();
    EXPECT_TRUE(one->sleep_until(deadline, one->wakes(), {}));
    EXPECT_GE(other->monotonic_ns(), deadline);
    EXPECT_LT(std::chrono::steady_clock::now() - real_start, std::chrono::seconds(5));
    const std::int64_t wall_before = one->wall_ns();
    EXPECT_TRUE(one->sleep_until(one->monotonic_ns() + 10 * s, one->wakes(), {}));
    EXPECT_GE(one->wall_ns() - wall_before, 10 * s);
}

TEST(LockstepClock, TimeStandsStillUntilTheWorkIsDone) {
    const auto clock = lockstep_clock(0, 1000 * s);
    std::jthread sleeper([&](const std::stop_token& stop) {
        EXPECT_TRUE(clock->sleep_until(15 * s, clock->wakes(), stop));
        EXPECT_TRUE(clock->sleep_until(30 * s, clock->wakes(), stop));
    });
    clock->settled(0);
    while (clock->monotonic_ns() < 15 * s) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_EQ(clock->monotonic_ns(), 15 * s);
    EXPECT_EQ(clock->wall_ns(), 1015 * s);
    clock->settled(15 * s);
    sleeper.join();
    EXPECT_EQ(clock->monotonic_ns(), 30 * s);
}

}  // namespace
}  // namespace thermbal
