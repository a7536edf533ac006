#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "filter/gaps.hpp"
#include "filter/outliers.hpp"

namespace thermbal {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<double> warm_up(std::size_t samples) {
    std::vector<double> values(samples);
    for (std::size_t k = 0; k < samples; ++k)
        values[k] = 26.7 - 8.7 * std::exp(-static_cast<double>(k) / 100.0);
    return values;
}

std::vector<double> measured(std::size_t samples, std::uint64_t seed, double noise_sd_C = 0.05) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0.0, noise_sd_C);
    auto values = warm_up(samples);
    for (double& value : values) value = std::round((value + noise(random)) * 10.0) / 10.0;
    return values;
}

TEST(Gaps, AreFilledCloseToTheTruth) {
    const auto truth = warm_up(400);
    auto values = measured(400, 1);
    for (const std::size_t k : {100U, 150U, 151U, 152U, 300U}) values[k] = NAN;
    for (std::size_t k = 200; k < 220; ++k) values[k] = NAN;
    const auto filled = fill_short_gaps(values, {});
    ASSERT_TRUE(filled);
    EXPECT_EQ(filled->filled, 25u);
    EXPECT_EQ(filled->longest_gap, 20u);
    EXPECT_EQ(filled->first, 0u);
    for (std::size_t k = 0; k < truth.size(); ++k) {
        EXPECT_EQ(filled->is_filled[k], std::isnan(values[k])) << k;
        if (std::isnan(values[k])) {
            EXPECT_NEAR(filled->values_C[k], truth[k], 0.09) << k;
        } else {
            EXPECT_EQ(filled->values_C[k], values[k]) << k;
        }
    }
}

TEST(Gaps, OfACubicAreFilledExactly) {
    std::vector<double> cubic(60);
    for (std::size_t k = 0; k < cubic.size(); ++k) {
        const double x = static_cast<double>(k) / 30.0;
        cubic[k] = 1.0 + 2.0 * x - 3.0 * x * x + x * x * x;
    }
    auto values = cubic;
    for (std::size_t k = 25; k < 33; ++k) values[k] = NAN;
    const auto filled = fill_short_gaps(values, {});
    ASSERT_TRUE(filled);
    for (std::size_t k = 0; k < cubic.size(); ++k) EXPECT_NEAR(filled->values_C[k], cubic[k], 1e-10) << k;
}

TEST(Gaps, LongerThanStatedAreRefused) {
    auto values = warm_up(200);
    for (std::size_t k = 50; k < 71; ++k) values[k] = NAN;
    const auto refused = fill_short_gaps(values, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().next, NextStep::refuse_input);
    EXPECT_EQ(refused.error().message,
              "21 samples in a row are missing from sample 50 on: at most 20 are interpolated");
}

TEST(Gaps, TheSamplesAfterTheNewestLongOneBeginWhereItEnds) {
    auto values = warm_up(200);
    EXPECT_EQ(after_last_long_gap(values, {}), 0u);
    for (std::size_t k = 0; k < 30; ++k) values[k] = NAN;     // before the first
    for (std::size_t k = 50; k < 71; ++k) values[k] = NAN;    // long
    for (std::size_t k = 100; k < 120; ++k) values[k] = NAN;  // as long as may be filled
    for (std::size_t k = 170; k < 200; ++k) values[k] = NAN;  // after the last
    EXPECT_EQ(after_last_long_gap(values, {}), 71u);
}

TEST(Gaps, AtTheEndsAreLeftOutAndNeverExtrapolated) {
    auto values = warm_up(100);
    for (const std::size_t k : {0U, 1U, 97U, 98U, 99U}) values[k] = NAN;
    const auto filled = fill_short_gaps(values, {});
    ASSERT_TRUE(filled);
    EXPECT_EQ(filled->first, 2u);
    EXPECT_EQ(filled->trailing_missing, 3u);
    EXPECT_EQ(filled->values_C.size(), 95u);
    EXPECT_EQ(filled->values_C.front(), values[2]);
    EXPECT_EQ(filled->values_C.back(), values[96]);
    EXPECT_FALSE(fill_short_gaps(std::vector<double>(30, NAN), {}));
    EXPECT_FALSE(fill_short_gaps(std::vector<double>{}, {}));
    EXPECT_TRUE(fill_short_gaps(std::vector<double>{NAN, 3.0, NAN}, {}));
    EXPECT_TRUE(fill_short_gaps(std::vector<double>{3.0, NAN, 4.0}, {}));
}

TEST(Outliers, SpikesAreMarked) {
    auto values = measured(400, 2);
    values[120] += 3.0;
    values[200] -= 1.0;
    values[201] -= 1.2;
    values[310] = 85.0;
    const auto marked = mark_outliers(values, {});
    ASSERT_TRUE(marked);
    EXPECT_THAT(marked->spikes, ElementsAre(120, 200, 201, 310));
    EXPECT_EQ(marked->undecided, 0u);
    EXPECT_TRUE(std::isnan(marked->values_C[200]));
    EXPECT_EQ(marked->values_C[199], values[199]);
}

TEST(Outliers, NoiseAndRoundingAreNone) {
    std::size_t marked_samples = 0;
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        const auto marked = mark_outliers(measured(1600, seed), {});
        marked_samples += marked->spikes.size() + marked->undecided;
    }
    EXPECT_LE(marked_samples, 2u);  // of 80 000
}

TEST(Outliers, ARealStepIsKept) {
    for (const double height_C : {-4.0, -0.6, 0.5, 1.0, 8.0}) {
        for (std::size_t at = 290; at < 300; ++at) {
            auto values = measured(400, 3);
            for (std::size_t k = at; k < values.size(); ++k) values[k] += height_C;
            const auto marked = mark_outliers(values, {});
            EXPECT_THAT(marked->spikes, IsEmpty()) << height_C << " at " << at;
        }
    }
}

TEST(Outliers, AtTheNewestEndAStepIsKeptOnceItIsLongerThanASpike) {
    for (std::size_t length = 1; length <= 8; ++length) {
        auto values = measured(300, 4);
        for (std::size_t k = values.size() - length; k < values.size(); ++k) values[k] += 4.0;
        const auto marked = mark_outliers(values, {});
        EXPECT_THAT(marked->spikes, IsEmpty()) << length;
        EXPECT_EQ(marked->undecided, length <= 2 ? length : 0) << length;
    }
}

TEST(Outliers, TheSteepStartOfAWarmUpIsKept) {
    std::vector<double> values(200);
    for (std::size_t k = 0; k < values.size(); ++k) {
        const double minutes = 0.25 * static_cast<double>(k);
        values[k] =
            std::round((18.0 + (minutes < 5.0 ? 0.0 : 12.0 * (1.0 - std::exp(-(minutes - 5.0) / 4.0)))) *
                       10.0) /
            10.0;
    }
    const auto marked = mark_outliers(values, {});
    EXPECT_THAT(marked->spikes, IsEmpty());
}

TEST(FilterOptions, OutOfBoundsAreRefusedByName) {
    GapOptions gaps;
    gaps.degree = 9;
    EXPECT_NE(fill_short_gaps(warm_up(50), gaps).error().message.find("degree = 9"), std::string::npos);
    OutlierOptions outliers;
    outliers.threshold = 0.0;
    EXPECT_NE(mark_outliers(warm_up(50), outliers).error().message.find("threshold = 0"), std::string::npos);
}

}  // namespace
}  // namespace thermbal
