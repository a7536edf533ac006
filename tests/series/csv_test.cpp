#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "series/recorded_test.hpp"

namespace thermbal {
namespace {

using testing::HasSubstr;

TEST(Csv, ReadsChannelsInputsCommentsQuotesAndMissingSamples) {
    const auto test = parse_recorded_test(
        "# a comment, with \"quotes\n# "
        "another\ntime_s,T1,\"T5\",spindle_rpm\r\n0,18.0,18.1,0\r\n15,,\"18.3\",5000\n",
        "a.csv");
    ASSERT_TRUE(test) << test.error().message;
    EXPECT_THAT(test->time_s, testing::ElementsAre(0.0, 15.0));
    ASSERT_EQ(test->channels.size(), 2U);
    EXPECT_EQ(test->channels[1].name, "T5");
    EXPECT_TRUE(std::isnan(test->channels[0].values[1]));
    EXPECT_DOUBLE_EQ(test->channels[1].values[1], 18.3);
    ASSERT_EQ(test->inputs.size(), 1U);
    EXPECT_DOUBLE_EQ(test->inputs[0].values[1], 5000.0);
}

TEST(Csv, WhatIsWrittenReadsBackToTheSameDoubles) {
    RecordedTest test{
        {0.0, 15.000001, 30.1}, {{"T1", {18.1, std::nan(""), 0.1 + 0.2}}}, {{"spindle_rpm", {1, 2, 3}}}};
    const auto again = parse_recorded_test(format_recorded_test(test), "again");
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->time_s, test.time_s);
    EXPECT_EQ(again->channels[0].values[2], test.channels[0].values[2]);
    EXPECT_TRUE(std::isnan(again->channels[0].values[1]));
    EXPECT_EQ(again->inputs[0].values, test.inputs[0].values);
}

TEST(Csv, ANameOfAnInputIsNoChannelsAndFitsAnyProgram) {
    for (const char* name : {"spindle_rpm", "x", "_load", "T", "Tool", "T1x"})
        EXPECT_TRUE(is_input_name(name)) << name;
    for (const char* name : {"", "T1", "T16", "time_s", "2nd", "spindle rpm", "a=b", "\u00e4"})
        EXPECT_FALSE(is_input_name(name)) << name;
    EXPECT_FALSE(is_input_name(std::string(65, 'x')));
}

TEST(Csv, AnInputMayHaveAnyName) {
    const RecordedTest test{{0.0}, {{"T1", {1.0}}}, {{"load, \"of\"\r\nthe spindle", {2.0}}}};
    const auto again = parse_recorded_test(format_recorded_test(test), "again");
    ASSERT_TRUE(again) << again.error().message;
    ASSERT_EQ(again->inputs.size(), 1U);
    EXPECT_EQ(again->inputs[0].name, test.inputs[0].name);
    EXPECT_EQ(again->inputs[0].values, test.inputs[0].values);
}

TEST(Csv, OnlyTemperaturesAreBounded) {
    const auto test =
        parse_recorded_test("time_s,T1,offset\n0,-273.15,-9999\n15,3000,1e308\n30,,\n", "inputs.csv");
    ASSERT_TRUE(test) << test.error().message;
    EXPECT_EQ(test->inputs[0].values[0], -9999.0);
}

TEST(Csv, AGapOfAWeekendAndAWeekAtASecondAreTaken) {
    EXPECT_TRUE(parse_recorded_test("time_s,T1\n0,1\n15,1\n30,1\n223230,1\n", "weekend.csv"));
    EXPECT_TRUE(parse_recorded_test("time_s,T1\n0,1\n1,1\n2,1\n604800,1\n", "week.csv"));
}

struct Refused {
    const char* text;
    const char* message;
};

class CsvRefused : public testing::TestWithParam<Refused> {};

TEST_P(CsvRefused, SaysFileLineColumnAndWhatWasFound) {
    const auto test = parse_recorded_test(GetParam().text, "bad.csv");
    ASSERT_FALSE(test);
    EXPECT_EQ(test.error().next, NextStep::refuse_input);
    EXPECT_THAT(test.error().message, HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Csv, CsvRefused,
    testing::Values(
        Refused{"", "bad.csv:1:1: no header"}, Refused{"t,T1\n0,1\n", "first column is 't'"},
        Refused{"time_s,T1\n", "no row follows"}, Refused{"time_s,T1,T1\n0,1,2\n", "'T1' stands twice"},
        Refused{"time_s,T1\n0,1\n0,2\n", "bad.csv:3:1: time_s is 0 after 0"},
        Refused{"time_s,T1\n0,1\n15,abc\n", "bad.csv:3:4: T1 is 'abc'"},
        Refused{"time_s,T1\n0,1,2\n", "3 cells, the header has 2"},
        Refused{"time_s,T1\n0,inf\n", "T1 is 'inf'"}, Refused{"time_s,T1\n\"0,1\n", "not closed"},
        Refused{"time_s,\"T1\"x,T2\n0,1,2\n", "text follows its closing quote"},
        Refused{"time_s,T1\n0,1\n15,1\n30,1\n1e9,1\n",
                "bad.csv:5:1: time_s is 1000000000 after 30; with a row each 15 s"},
        Refused{"time_s,T1\n0,1\n15,1\n30,1\n1e300,1\n", "bad.csv:5:1: time_s is 1e+300 after 30"},
        Refused{"time_s,T1\n-1e12,1\n0,1\n15,1\n30,1\n", "bad.csv:3:1: time_s is 0 after -1000000000000"},
        Refused{"time_s,T1\n-1.7e308,1\n0,1\n1.7e308,1\n", "Mend the time, or split the file here"},
        Refused{"time_s,T1,T2\n0,18,18\n15,18,-9999\n",
                "bad.csv:3:7: T2 is -9999 C, which is no temperature (-273.15 to 3000 C); leave the "
                "cell empty"},
        Refused{"time_s,T1\n0,1e308\n", "bad.csv:2:3: T1 is 1e308 C"},
        Refused{"time_s,\n0,1\n", "a column has no name"}, Refused{"time_s,T1\n,1\n", "time_s is ''"}));

}  // namespace
}  // namespace thermbal
