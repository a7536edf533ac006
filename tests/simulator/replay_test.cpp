#include <cmath>

#include <gmock/gmock.h>

#include "replay/recorded_scans.hpp"

namespace thermbal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

RecordedScans scans(const char* csv) {
    return *RecordedScans::from(*parse_recorded_test(csv, "here.csv"), "here.csv");
}

TEST(RecordedScans, TheNewestRowCounts) {
    const RecordedScans recording =
        scans("time_s,T1,T2,spindle_rpm\n0,18,18.5,5000\n15,18.1,,5000\n30,18.2,19,5000\n");
    EXPECT_THAT(recording.at(-5.0), ElementsAre(18, 18.5));
    EXPECT_THAT(recording.at(14.9), ElementsAre(18, 18.5));
    EXPECT_THAT(recording.at(30.0), ElementsAre(18.2, 19));
    EXPECT_THAT(recording.at(29.9999), ElementsAre(18.2, 19));
    EXPECT_THAT(recording.at(1e6), ElementsAre(18.2, 19));
}

TEST(RecordedScans, AMissingSampleStaysMissing) {
    const RecordedScans recording = scans("time_s,T1,T2\n0,18,18.5\n15,18.1,\n");
    EXPECT_EQ(recording.at(15.0)[0], 18.1);
    EXPECT_TRUE(std::isnan(recording.at(15.0)[1]));
}

TEST(RecordedScans, WhatCannotBeReplayedIsRefused) {
    const auto absent = RecordedScans::load("/nonexistent/test.csv");
    ASSERT_FALSE(absent);
    EXPECT_EQ(absent.error().next, NextStep::refuse_input);
    EXPECT_THAT(absent.error().message, HasSubstr("/nonexistent/test.csv"));
    const auto empty =
        RecordedScans::from(RecordedTest{.time_s = {}, .channels = {{"T1", {}}}, .inputs = {}}, "e.csv");
    ASSERT_FALSE(empty);
    EXPECT_THAT(empty.error().message, HasSubstr("no rows"));
}

}  // namespace
}  // namespace thermbal
