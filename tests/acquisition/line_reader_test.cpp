#include "acquisition/line_reader.hpp"

#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

constexpr std::int64_t ms = 1'000'000;

class FakeLine final : public Line {
  public:
    std::vector<ChannelSample> read_scan() override {
        std::this_thread::sleep_for(std::chrono::milliseconds(read_ms.load()));
        ++reads;
        return {{0, Sample{215U, 21.5, Quality::good}}};
    }
    Result<void> write(const RegisterWrite& write) override {
        written = write.address;
        return {};
    }
    std::atomic<int> read_ms = 0;
    std::atomic<int> reads = 0;
    std::atomic<int> written = -1;
};

std::vector<LineScan> collect(Mailbox<LineScan>& mailbox, std::size_t count) {
    std::vector<LineScan> all;
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (all.size() < count && std::chrono::steady_clock::now() < give_up) {
        for (LineScan& scan : mailbox.take()) all.push_back(std::move(scan));
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return all;
}

TEST(LineReader, ReadsOnTheGridAndSkipsWhatItIsTooLateFor) {
    FakeLine line;
    Mailbox<LineScan> mailbox;
    const auto clock = system_clock();
    LineReader reader(0, line, *clock, mailbox);
    const Grid grid{clock->monotonic_ns() + 20 * ms, 20 * ms};
    reader.follow(grid, 1, 0);
    auto scans = collect(mailbox, 10);
    line.read_ms = 90;
    for (LineScan& scan : collect(mailbox, 3)) scans.push_back(std::move(scan));
    line.read_ms = 0;
    for (LineScan& scan : collect(mailbox, 5)) scans.push_back(std::move(scan));
    ASSERT_GE(scans.size(), 18U);
    for (std::size_t i = 0; i < scans.size(); ++i) {
        EXPECT_GE(scans[i].started_ns, grid.due_ns(scans[i].scan)) << "read before it was due";
    }
    for (std::size_t i = 1; i < scans.size(); ++i) EXPECT_GT(scans[i].scan, scans[i - 1].scan);
    EXPECT_GT(scans.back().scan, static_cast<std::int64_t>(scans.size())) << "the slow reads skipped scans";
}

TEST(LineReader, FollowsANewGridAtOnce) {
    FakeLine line;
    Mailbox<LineScan> mailbox;
    const auto clock = system_clock();
    LineReader reader(0, line, *clock, mailbox);
    reader.follow({clock->monotonic_ns() + 3'600'000 * ms, 1000 * ms}, 1, 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    reader.follow({clock->monotonic_ns(), 20 * ms}, 2, 0);
    const auto scans = collect(mailbox, 2);
    ASSERT_GE(scans.size(), 2U);
    EXPECT_EQ(scans[0].generation, 2U);
}

TEST(LineReader, WritesBetweenReadsWithoutWaitingForTheGrid) {
    FakeLine line;
    Mailbox<LineScan> mailbox;
    const auto clock = system_clock();
    LineReader reader(0, line, *clock, mailbox);
    reader.follow({clock->monotonic_ns() + 3'600'000 * ms, 1000 * ms}, 1, 0);
    std::atomic<bool> done = false;
    reader.write({1, true, 7, 0}, [&](const Result<void>& result) { done = result.has_value(); });
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (!done && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
    EXPECT_TRUE(done);
    EXPECT_EQ(line.written, 7);
    EXPECT_EQ(line.reads, 0);
}

}  // namespace
}  // namespace thermbal
