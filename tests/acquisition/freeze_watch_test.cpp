#include "acquisition/freeze_watch.hpp"

#include <random>

#include <gtest/gtest.h>

namespace thermbal {
namespace {

/// 8 channels of one module whose last digit flickers, as those of a real one do.
class FreezeWatchTest : public ::testing::Test {
  protected:
    static constexpr std::size_t channels = 8;
    FreezeWatch watch{{{.name = "module", .channels = {0, 1, 2, 3, 4, 5, 6, 7}, .frozen_after_scans = 120}}};
    std::mt19937 random{5};
    std::int64_t next = 0;
    std::vector<std::uint32_t> words = std::vector<std::uint32_t>(channels, 200U);

    std::vector<FreezeChange> take(Scan& scan) { return watch.take(scan); }

    Scan scan_of_words() {
        Scan scan;
        scan.scan = next++;
        scan.status = ScanStatus::ok;
        for (const std::uint32_t word : words)
            scan.samples.push_back({word, 0.1 * static_cast<double>(word), Quality::good});
        return scan;
    }
    Scan flicker() {
        std::bernoulli_distribution changes(0.3);
        for (std::uint32_t& word : words) word = changes(random) ? 200U + random() % 2 : word;
        return scan_of_words();
    }
    void learn(int scans) {
        for (int i = 0; i < scans; ++i) {
            Scan scan = flicker();
            EXPECT_TRUE(take(scan).empty());
        }
    }
};

TEST_F(FreezeWatchTest, AFlickeringModuleIsNeverFrozen) {
    std::size_t stuck = 0;
    for (int i = 0; i < 200'000; ++i) {
        Scan scan = flicker();
        stuck += take(scan).size();
    }
    EXPECT_EQ(stuck, 0U);
}

TEST_F(FreezeWatchTest, AFrozenOneIsNoticedWithinMinutesAndBackAtTheFirstChange) {
    learn(300);
    words[0] ^= 1U;
    Scan scan = scan_of_words();
    std::vector<FreezeChange> changes = take(scan);
    const std::int64_t last_change = scan.scan;
    for (int i = 0; i < 40 && changes.empty(); ++i) {
        scan = scan_of_words();
        changes = take(scan);
    }
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_TRUE(changes[0].frozen);
    EXPECT_EQ(changes[0].first_scan, last_change + 1);
    EXPECT_LE(scan.scan - last_change, 20) << "minutes, not hours";
    for (const Sample& sample : scan.samples) {
        EXPECT_EQ(sample.quality, Quality::stuck);
        EXPECT_TRUE(std::isnan(sample.value_C));
        EXPECT_TRUE(sample.raw) << "the word is kept";
    }
    words[3] += 1;
    scan = scan_of_words();
    changes = take(scan);
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_FALSE(changes[0].frozen);
    for (const Sample& sample : scan.samples) EXPECT_TRUE(sample.good());
}

TEST_F(FreezeWatchTest, AModuleThatNeverChangedIsOnlyJudgedByTheLongLimit) {
    for (int i = 0; i < 120; ++i) {
        Scan scan = scan_of_words();
        EXPECT_TRUE(take(scan).empty()) << i;
    }
    Scan scan = scan_of_words();
    const auto changes = take(scan);
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_EQ(changes[0].first_scan, 1);
}

TEST_F(FreezeWatchTest, ASilentScanNeitherFreezesNorThaws) {
    learn(300);
    for (int i = 0; i < 40; ++i) {
        Scan scan = scan_of_words();
        take(scan);
        Scan silent;
        silent.scan = next++;
        silent.samples.assign(channels, Sample{.raw = {}, .quality = Quality::communication});
        EXPECT_TRUE(take(silent).empty());
        for (const Sample& sample : silent.samples) EXPECT_EQ(sample.quality, Quality::communication);
    }
    Scan scan = scan_of_words();
    take(scan);
    EXPECT_EQ(scan.samples[0].quality, Quality::stuck);
}

TEST_F(FreezeWatchTest, AModuleThatConvertsSlowerThanItIsReadIsNotFrozen) {
    for (int i = 0; i < 20'000; ++i) {
        Scan scan = i % 10 == 0 ? flicker() : scan_of_words();
        EXPECT_TRUE(take(scan).empty()) << i;
    }
}

TEST_F(FreezeWatchTest, AFaultCodeStaysWhatItIs) {
    learn(300);
    for (int i = 0; i < 40; ++i) {
        Scan scan = scan_of_words();
        scan.samples[2] = {0x7FFFU, no_value, Quality::open};
        take(scan);
        EXPECT_EQ(scan.samples[2].quality, Quality::open);
    }
}

}  // namespace
}  // namespace thermbal
