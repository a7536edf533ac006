#include "acquisition/freeze_watch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <ostream>
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

TEST_F(FreezeWatchTest, OneThatComesBackWithManyNewWordsIsStillKnown) {
    learn(300);
    for (int i = 0; i < 40; ++i) {
        Scan scan = scan_of_words();
        take(scan);
    }
    for (std::uint32_t& word : words) ++word;
    Scan back = scan_of_words();
    ASSERT_EQ(take(back).size(), 1U);
    int noticed_after = 0;
    for (std::vector<FreezeChange> changes; changes.empty() && noticed_after < 120; ++noticed_after) {
        Scan scan = scan_of_words();
        changes = take(scan);
    }
    EXPECT_LE(noticed_after, 20);
}

TEST_F(FreezeWatchTest, OneThatComesBackByOneStepOfOneChannelWasStillOnly) {
    learn(300);
    const auto still = [&](int scans) {
        std::size_t seen = 0;
        for (int i = 0; i < scans; ++i) {
            Scan scan = scan_of_words();
            seen += take(scan).size();
        }
        return seen;
    };
    EXPECT_EQ(still(100), 1U);
    ++words[4];
    EXPECT_EQ(still(1), 1U);
    EXPECT_EQ(still(100), 0U) << "what settled goes on being still";
}

TEST_F(FreezeWatchTest, OneChannelThatLeavesTheEdgeBetweenTwoWordsIsNoFreeze) {
    for (int i = 0; i < 500; ++i) {
        words[3] = 200U + random() % 2;
        Scan scan = scan_of_words();
        EXPECT_TRUE(take(scan).empty());
    }
    for (int i = 0; i < 100; ++i) {
        Scan scan = scan_of_words();
        EXPECT_TRUE(take(scan).empty()) << i;
    }
}

/// What a module shows of a machine: every channel the same time constants, shares of its own, noise and
/// steps; a room that sways.
struct Machine {
    enum class Course : std::uint8_t { warms_up, warms_up_and_cools, rests };
    std::size_t channels;
    double step_C;
    double noise_C;
    Course course;

    friend std::ostream& operator<<(std::ostream& out, const Machine& machine) {
        return out << machine.channels << " channels, steps of " << machine.step_C << " C, noise "
                   << machine.noise_C << " C, course " << static_cast<int>(machine.course);
    }
};

class Shown {
  public:
    Shown(const Machine& machine, std::uint64_t seed) : machine_(machine), random_(seed) {
        const auto modes = static_cast<std::size_t>(uniform(1.0, 4.0));
        const double rise_C = machine.course == Machine::Course::rests ? 0.0 : 2.0 * std::pow(20.0, share());
        for (double& tau_min : taus_min_) tau_min = 10.0 * std::pow(12.0, share());
        stop_min_ = machine.course == Machine::Course::warms_up ? 1e9 : uniform(60.0, 310.0);
        sway_period_min_ = uniform(120.0, 2160.0);
        const double room_C = share() < 0.4 ? 0.0 : 0.5;
        for (Channel& channel : channels_) {
            for (std::size_t mode = 0; mode < modes; ++mode)
                channel.rise_C[mode] = rise_C * share() * share() * 1.5 / static_cast<double>(modes);
            channel.start_C = uniform(20.0, 25.0);
            channel.sway_C = room_C * share();
        }
    }

    /// Its words at `scan`, 15 s apart from 0 on.
    std::vector<std::uint32_t> words(std::int64_t scan) {
        const double min = static_cast<double>(scan) / 4.0;
        std::vector<std::uint32_t> words;
        for (const Channel& channel : channels_) {
            double value_C = channel.start_C + channel.sway_C * std::sin(6.283 * min / sway_period_min_);
            for (std::size_t mode = 0; mode < taus_min_.size(); ++mode)
                value_C += channel.rise_C[mode] * response(min, taus_min_[mode]);
            value_C += machine_.noise_C * normal();
            words.push_back(static_cast<std::uint32_t>(std::lround(value_C / machine_.step_C) + 1000));
        }
        return words;
    }

  private:
    struct Channel {
        double start_C = 0.0;
        double sway_C = 0.0;
        std::array<double, 3> rise_C{};
    };

    double response(double min, double tau_min) const {
        const double warm = 1.0 - std::exp(-std::min(min, stop_min_) / tau_min);
        return min > stop_min_ ? warm * std::exp(-(min - stop_min_) / tau_min) : warm;
    }
    double share() { return static_cast<double>(random_() >> 11U) * 0x1p-53; }
    double uniform(double low, double high) { return low + (high - low) * share(); }
    double normal() { return std::normal_distribution<double>(0.0, 1.0)(random_); }

    Machine machine_;
    std::mt19937_64 random_;
    std::array<double, 3> taus_min_{};
    double stop_min_ = 0.0;
    double sway_period_min_ = 0.0;
    std::vector<Channel> channels_ = std::vector<Channel>(machine_.channels);
};

class FreezeWatchOfMachine : public ::testing::TestWithParam<Machine> {
  protected:
    static constexpr std::int64_t limit = 120;

    static FreezeWatch watch_of(const Machine& machine) {
        WatchedModule module{.name = "module", .channels = {}, .frozen_after_scans = limit};
        module.channels.resize(machine.channels);
        std::iota(module.channels.begin(), module.channels.end(), 0U);
        return FreezeWatch({module});
    }
    static Scan scan_of(std::int64_t number, const std::vector<std::uint32_t>& words) {
        Scan scan;
        scan.scan = number;
        scan.status = ScanStatus::ok;
        for (const std::uint32_t word : words) scan.samples.push_back({word, 20.0, Quality::good});
        return scan;
    }
};

TEST_P(FreezeWatchOfMachine, IsNotCalledFrozenWhileItSettles) {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
        Shown shown(GetParam(), seed);
        FreezeWatch watch = watch_of(GetParam());
        for (std::int64_t k = 0; k < 1600; ++k) {
            Scan scan = scan_of(k, shown.words(k));
            for (const FreezeChange& change : watch.take(scan)) {
                EXPECT_TRUE(!change.frozen || k + 1 - change.first_scan == limit)
                    << "seed " << seed << ": still from scan " << change.first_scan << " to " << k;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(WarmUps, FreezeWatchOfMachine,
                         ::testing::Values(Machine{1, 0.1, 0.02, Machine::Course::warms_up},
                                           Machine{2, 0.1, 0.02, Machine::Course::warms_up},
                                           Machine{8, 0.1, 0.005, Machine::Course::warms_up},
                                           Machine{16, 0.1, 0.005, Machine::Course::warms_up},
                                           Machine{4, 1.0, 0.02, Machine::Course::warms_up},
                                           Machine{16, 1.0, 0.05, Machine::Course::warms_up},
                                           Machine{16, 0.1, 0.02, Machine::Course::warms_up},
                                           Machine{4, 0.01, 0.002, Machine::Course::warms_up}));

INSTANTIATE_TEST_SUITE_P(CoolDownsAndRest, FreezeWatchOfMachine,
                         ::testing::Values(Machine{2, 0.1, 0.01, Machine::Course::warms_up_and_cools},
                                           Machine{8, 0.1, 0.02, Machine::Course::warms_up_and_cools},
                                           Machine{16, 0.1, 0.005, Machine::Course::warms_up_and_cools},
                                           Machine{8, 1.0, 0.05, Machine::Course::warms_up_and_cools},
                                           Machine{1, 0.1, 0.02, Machine::Course::rests},
                                           Machine{8, 0.1, 0.005, Machine::Course::rests},
                                           Machine{8, 1.0, 0.05, Machine::Course::rests},
                                           Machine{16, 0.1, 0.01, Machine::Course::rests}));

/// With noise as wide as half a step, a freeze at any time of the warm-up.
class FreezeWatchOfNoisyMachine : public FreezeWatchOfMachine {};

TEST_P(FreezeWatchOfNoisyMachine, ARealFreezeIsNoticedWithinMinutes) {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
        Shown shown(GetParam(), seed);
        FreezeWatch watch = watch_of(GetParam());
        const auto freezes_at = static_cast<std::int64_t>(60 + 90 * seed);
        std::int64_t noticed_after = 0;
        std::vector<std::uint32_t> words;
        for (std::int64_t k = 0; noticed_after == 0 && k < freezes_at + limit; ++k) {
            if (k <= freezes_at) words = shown.words(k);
            Scan scan = scan_of(k, words);
            if (!watch.take(scan).empty()) noticed_after = k - freezes_at;
        }
        EXPECT_GE(noticed_after, 4) << seed;
        EXPECT_LE(noticed_after, 30) << seed;
    }
}

INSTANTIATE_TEST_SUITE_P(WarmUps, FreezeWatchOfNoisyMachine,
                         ::testing::Values(Machine{8, 0.1, 0.05, Machine::Course::warms_up},
                                           Machine{16, 0.1, 0.05, Machine::Course::warms_up},
                                           Machine{2, 0.01, 0.02, Machine::Course::warms_up},
                                           Machine{1, 0.01, 0.02, Machine::Course::warms_up}));

}  // namespace
}  // namespace thermbal
