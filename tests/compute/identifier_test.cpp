#include "compute/identifier.hpp"

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

using namespace std::chrono_literals;

class Results {
  public:
    void add(IdentificationResult result) {
        const std::lock_guard lock(mutex_);
        scans_.push_back(result.window_end_scan);
    }
    std::vector<std::int64_t> scans() const {
        const std::lock_guard lock(mutex_);
        return scans_;
    }
    bool wait_for(std::size_t count) const {
        const auto give_up = std::chrono::steady_clock::now() + 20s;
        while (scans().size() < count && std::chrono::steady_clock::now() < give_up)
            std::this_thread::sleep_for(1ms);
        return scans().size() >= count;
    }

  private:
    mutable std::mutex mutex_;
    std::vector<std::int64_t> scans_;
};

TEST(Identifier, TheNewestWindowWinsOverOneThatStillWaits) {
    Results results;
    std::atomic<bool> go = false;
    std::atomic<int> begun = 0;
    Identifier identifier(
        [&](const IdentificationJob&, const std::function<bool()>&) {
            ++begun;
            while (!go) std::this_thread::yield();
            return Result<WindowVerdict>(WindowVerdict{});
        },
        [&](IdentificationResult result) { results.add(std::move(result)); });
    identifier.submit({1, 10, {}, {}, {}});
    while (begun == 0) std::this_thread::yield();
    identifier.submit({1, 20, {}, {}, {}});
    identifier.submit({1, 30, {}, {}, {}});
    go = true;
    ASSERT_TRUE(results.wait_for(2));
    EXPECT_EQ(results.scans(), (std::vector<std::int64_t>{10, 30}));
}

TEST(Identifier, CancelEndsTheJobUnderWayAndNotTheNextOne) {
    Results results;
    std::atomic<int> begun = 0;
    Identifier identifier(
        [&](const IdentificationJob& job, const std::function<bool()>& cancelled) {
            ++begun;
            while (job.window_end_scan == 10 && !cancelled()) std::this_thread::yield();
            return Result<WindowVerdict>(WindowVerdict{});
        },
        [&](IdentificationResult result) { results.add(std::move(result)); });
    identifier.submit({1, 10, {}, {}, {}});
    while (begun == 0) std::this_thread::yield();
    identifier.cancel();
    identifier.submit({2, 20, {}, {}, {}});
    ASSERT_TRUE(results.wait_for(1));
    EXPECT_EQ(results.scans(), (std::vector<std::int64_t>{20}));
}

TEST(Identifier, EndsWhileAJobIsUnderWay) {
    std::atomic<int> begun = 0;
    {
        Identifier identifier(
            [&](const IdentificationJob&, const std::function<bool()>& cancelled) {
                ++begun;
                while (!cancelled()) std::this_thread::yield();
                return Result<WindowVerdict>(WindowVerdict{});
            },
            [](const IdentificationResult&) { FAIL() << "a cancelled job has no result"; });
        identifier.submit({1, 10, {}, {}, {}});
        while (begun == 0) std::this_thread::yield();
    }
    EXPECT_EQ(begun, 1);
}

}  // namespace
}  // namespace thermbal
