#include "compute/threads.hpp"

#include <atomic>
#include <vector>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace thermbal
