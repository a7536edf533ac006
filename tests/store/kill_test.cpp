#include <chrono>
#include <csignal>
#include <cstdlib>
#include <random>

#include <gmock/gmock.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include "store/store.hpp"
#include "support.hpp"

namespace thermbal::test {
namespace {

/// Resumes or begins a test, and appends scans as fast as it can; the number of each goes into the pipe only
/// after append_scan has returned.
[[noreturn]] void write_until_killed(const std::filesystem::path& path, int acknowledged) {
    auto store = Store::open(path, start);
    if (!store) _exit(20);
    const auto resumed = store->resume();
    if (!resumed) _exit(21);
    const auto id = *resumed ? Result<TestId>((*resumed)->test.id) : store->begin_test(test_record());
    if (!id) _exit(22);
    std::int64_t scan = *resumed ? (*resumed)->test.last_scan.value_or(-1) + 1 : 0;
    for (;; ++scan) {
        if (!store->append_scan(*id, scan_record(scan))) _exit(23);
        if (write(acknowledged, &scan, sizeof scan) != sizeof scan) _exit(24);
        if (scan % 7 == 0) (void)store->checkpoint();
    }
}

enum class CountedFrom { start, first_scan };

/// Kills from the start also meet the opening; on a slow machine they meet nothing else.
std::vector<std::int64_t> kill_after(const std::filesystem::path& path, CountedFrom from,
                                     std::chrono::microseconds delay) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
        close(ends[0]);
        write_until_killed(path, ends[1]);
    }
    close(ends[1]);
    pollfd written{ends[0], POLLIN, 0};
    if (from == CountedFrom::first_scan) poll(&written, 1, -1);
    usleep(static_cast<useconds_t>(delay.count()));
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status)) << "the writer ended by itself: " << WEXITSTATUS(status);
    std::vector<std::int64_t> acknowledged;
    std::int64_t scan = 0;
    while (read(ends[0], &scan, sizeof scan) == sizeof scan) acknowledged.push_back(scan);
    close(ends[0]);
    return acknowledged;
}

/// A figure of the study in daemon/store/README.md, or that of a test run.
int wanted(const char* name, int otherwise) {
    const char* const text = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
    return text == nullptr ? otherwise : std::atoi(text);
}

TEST(KillTest, NoAcknowledgedScanIsLostOrDoubled) {
    const Folder folder;
    const auto path = folder / "thermbal.db";
    const auto seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> delay_us(0, 1000 * wanted("THERMBAL_KILL_WITHIN_MS", 60));

    std::int64_t highest = -1;
    std::size_t acknowledged_in_all = 0;
    const int kills = wanted("THERMBAL_KILLS", 120);
    for (int round = 0; round < kills; ++round) {
        const auto from = round % 2 == 0 ? CountedFrom::start : CountedFrom::first_scan;
        for (const auto scan : kill_after(path, from, std::chrono::microseconds(delay_us(random)))) {
            ASSERT_GT(scan, highest) << "acknowledged twice: a scan was lost in between";
            highest = scan;
            ++acknowledged_in_all;
        }
    }
    auto store = open_store(path);
    EXPECT_FALSE(store.set_aside().has_value());
    const auto resumed = store.resume();
    ASSERT_OK(resumed);
    ASSERT_TRUE(resumed->has_value());
    const auto scans = store.read().scans((*resumed)->test.id).value();
    ASSERT_GE(scans.size(), static_cast<std::size_t>(highest + 1));
    for (std::size_t k = 0; k < scans.size(); ++k) {
        ASSERT_EQ(scans[k].scan, static_cast<std::int64_t>(k));
        ASSERT_EQ(scans[k].samples.size(), 16U);
        for (std::size_t i = 0; i < 16; ++i)
            ASSERT_EQ(scans[k].samples[i].value_C, value_C(static_cast<std::int64_t>(k), i));
    }
    EXPECT_EQ(findings_text(*store.read().verify()), "");
    EXPECT_GT(acknowledged_in_all, static_cast<std::size_t>(kills))
        << "hardly anything was written: the test proves nothing";
    RecordProperty("acknowledged_scans", static_cast<int>(acknowledged_in_all));
}

}  // namespace
}  // namespace thermbal::test
