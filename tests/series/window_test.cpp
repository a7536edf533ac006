#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "series/recorded_test.hpp"
#include "series/sample.hpp"

namespace thermbal {
namespace {

using testing::DoubleEq;
using testing::ElementsAre;
using testing::NanSensitiveDoubleEq;

TEST(GoodValues, FirstAndLastPassOverWhatIsMissing) {
    const std::vector<double> values{no_value, 2.0, no_value, 3.0, no_value};
    EXPECT_EQ(first_good(values), 2.0);
    EXPECT_EQ(last_good(values), 3.0);
    EXPECT_TRUE(std::isnan(first_good({})));
    EXPECT_TRUE(std::isnan(last_good(std::vector{no_value})));
}

TEST(Window, RowsGoToTheirScanAndWhatIsNotThereStaysMissing) {
    const RecordedTest test{
        {0.0, 15.2, 44.9, 45.1}, {{"T1", {1.0, 2.0, 4.0, 6.0}}}, {{"spindle_rpm", {0, 5000, 5000, 0}}}};
    const TestWindow window = to_window(test, 15.0);
    EXPECT_EQ(window.scans, 4U);
    EXPECT_THAT(window.channels[0].values,
                ElementsAre(DoubleEq(1.0), DoubleEq(2.0), NanSensitiveDoubleEq(no_value), DoubleEq(5.0)));
    EXPECT_THAT(window.inputs[0].values, ElementsAre(0.0, 5000.0, 5000.0, 0.0));
    const RecordedTest again = recording_of(window);
    EXPECT_THAT(again.time_s, ElementsAre(0.0, 15.0, 30.0, 45.0));
    EXPECT_EQ(again.channels[0].name, "T1");
    EXPECT_EQ(again.inputs[0].values, window.inputs[0].values);
}

TEST(Window, UntilAndFromKeepTheScanAtTheLimit) {
    RecordedTest test;
    test.channels.push_back({"T2", {}});
    for (int k = 0; k < 100; ++k) {
        test.time_s.push_back(k * 0.1);
        test.channels[0].values.push_back(k);
    }
    const TestWindow window = to_window(test, median_step_s(test));
    for (int k = 0; k < 100; ++k) {
        EXPECT_EQ(window_until(window, k * 0.1).scans, static_cast<std::size_t>(k + 1));
        const TestWindow rest = window_from(window, k * 0.1);
        ASSERT_EQ(rest.scans, static_cast<std::size_t>(100 - k));
        EXPECT_EQ(rest.channels[0].values.front(), k);
        EXPECT_NEAR(rest.start_s, k * 0.1, 1e-12);
    }
    EXPECT_EQ(window_until(window, -1.0).scans, 0U);
    EXPECT_EQ(window_from(window, 1e9).scans, 0U);
    EXPECT_EQ(window_until(window, 1e300).scans, 100U);
    EXPECT_EQ(window_from(window, -1e300).scans, 100U);
    EXPECT_EQ(window_until(window, no_value).scans, 0U);
    EXPECT_EQ(window_from(window, no_value).scans, 0U);
}

TEST(Window, CoarsenedHoldsMeansOfGoodNeighboursAtTheirMiddle) {
    const TestWindow window{30.0,
                            15.0,
                            8,
                            {{"T1", {1, 2, 6, no_value, 5, no_value, no_value, 9}}},
                            {{"spindle_rpm", {0, 0, 5000, 5000, 5000, 0, 0, 0}}}};
    const TestWindow coarse = coarsened(window, 3);  // three each; the last two are no group
    EXPECT_EQ(coarse.scans, 2U);
    EXPECT_EQ(coarse.period_s, 45.0);
    EXPECT_EQ(coarse.start_s, 45.0);
    EXPECT_THAT(coarse.channels[0].values, ElementsAre(DoubleEq(3.0), DoubleEq(5.0)));
    EXPECT_THAT(coarse.inputs[0].values, ElementsAre(5000.0, 0.0));
    EXPECT_THAT(coarsened(window, 4).channels[0].values,
                ElementsAre(DoubleEq(1.5), DoubleEq(6.0), DoubleEq(5.0), DoubleEq(9.0)));
    EXPECT_EQ(coarsened(window, 8).scans, 8U);
    EXPECT_EQ(coarsened(window, 8).period_s, 15.0);
}

TEST(Quality, NamesReadBack) {
    for (int i = 0; i <= static_cast<int>(Quality::gap); ++i) {
        const auto quality = static_cast<Quality>(i);
        EXPECT_EQ(quality_from_string(to_string(quality)), quality);
    }
    EXPECT_FALSE(quality_from_string("fine"));
}

}  // namespace
}  // namespace thermbal
