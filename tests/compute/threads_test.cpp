#include "compute/threads.hpp"

#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <pthread.h>

namespace thermbal {
namespace {

TEST(Threads, EveryBodyRunsExactlyOnce) {
    for (const int threads : {0, 1, 2, 7}) {
        std::vector<std::atomic<int>> runs(1000);
        parallel_on_threads(threads, true)(runs.size(), [&](std::size_t i) { ++runs[i]; });
        for (const auto& count : runs) EXPECT_EQ(count, 1);
        parallel_on_threads(threads, false)(0, [](std::size_t) { FAIL(); });
    }
}

TEST(Threads, ABodyMayCallAgainAndNoMoreRunAtOnceThanAskedFor) {
    constexpr int threads = 3;
    const ParallelFor parallel_for = parallel_on_threads(threads, false);
    std::atomic<int> done = 0, running = 0, most = 0;
    parallel_for(5, [&](std::size_t) {
        parallel_for(20, [&](std::size_t) {
            const int now = ++running;
            for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
            }
            std::this_thread::sleep_for(std::chrono::microseconds(200));
            --running;
            ++done;
        });
    });
    EXPECT_EQ(done, 100);
    EXPECT_LE(most, threads);
    EXPECT_GT(most, 1);
}

/// While it lives the system makes no thread: a stack of the whole address space is asked for.
class NoThreadLeft {
  public:
    NoThreadLeft() {
        pthread_getattr_default_np(&before_);
        pthread_attr_t attributes;
        pthread_getattr_default_np(&attributes);
        pthread_attr_setstacksize(&attributes, std::size_t{1} << 47U);
        pthread_setattr_default_np(&attributes);
        pthread_attr_destroy(&attributes);
    }
    NoThreadLeft(const NoThreadLeft&) = delete;
    NoThreadLeft& operator=(const NoThreadLeft&) = delete;
    ~NoThreadLeft() {
        pthread_setattr_default_np(&before_);
        pthread_attr_destroy(&before_);
    }

  private:
    pthread_attr_t before_;
};

TEST(Threads, WhereNoThreadCanBeMadeThoseThereAreDoTheWork) {
    const ParallelFor parallel_for = parallel_on_threads(3, false);
    {
        const NoThreadLeft none;
        ASSERT_THROW(std::thread([] {}), std::system_error);
        int done = 0;
        parallel_for(100, [&](std::size_t) { ++done; });
        EXPECT_EQ(done, 100);
    }
    // Both bodies wait for each other, which one thread alone cannot.
    std::atomic<int> there = 0;
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    parallel_for(2, [&](std::size_t) {
        ++there;
        while (there < 2 && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
        EXPECT_EQ(there, 2);
    });
}

TEST(Threads, WhoIsDoneHelpsABodyThatStillRuns) {
    const ParallelFor parallel_for = parallel_on_threads(2, false);
    std::atomic<bool> first_done = false;
    std::set<std::thread::id> helping;
    std::mutex mutex;
    parallel_for(2, [&](std::size_t i) {
        if (i == 0) {
            first_done = true;
            return;
        }
        // The other thread gives itself back a moment after its body has returned.
        for (int attempt = 0; attempt < 1000 && helping.size() < 2; ++attempt) {
            parallel_for(2, [&](std::size_t) {
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
                const std::lock_guard lock(mutex);
                helping.insert(std::this_thread::get_id());
            });
        }
    });
    EXPECT_TRUE(first_done);
    EXPECT_EQ(helping.size(), 2U);
}

}  // namespace
}  // namespace thermbal
