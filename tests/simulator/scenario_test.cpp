#include "simulator/scenario.hpp"

#include <gmock/gmock.h>

namespace thermbal {
namespace {

using testing::HasSubstr;

TEST(Scenario, FaultsWithTheirTimesAndTargets) {
    const auto faults = parse_scenario(R"(
[[fault]]
kind = "exception"
value = 6
unit = 2
at_s = 600
for_s = 120.5

[[fault]]
kind = "open"
channel = "T7"
at_s = 0
)",
                                       "night.toml");
    ASSERT_TRUE(faults) << faults.error().message;
    ASSERT_EQ(faults->size(), 2U);
    EXPECT_EQ(to_string((*faults)[0]), "exception=6:2@600-720.5");
    EXPECT_EQ(to_string((*faults)[1]), "open:T7@0");
}

TEST(Scenario, WhatIsWrongIsNamedWithFileAndLine) {
    const std::pair<const char*, const char*> wrong[] = {
        {"[[fault]]\nkind = \"gone\"\nat_s = 0", "night.toml:1: fault 'gone': 'gone' is none of open"},
        {"[[fault]]\nkind = \"open\"", "at_s is missing"},
        {"[[fault]]\nkind = \"open\"\nat_s = -1", "at_s is missing or no time"},
        {"[[fault]]\nkind = \"open\"\nat_s = 0\nfor_s = 0", "for_s is no duration"},
        {"[[fault]]\nkind = \"open\"\nat_s = 0\nfor = 3", "night.toml:4: 'for'; accepted: kind, value"},
        {"[[fault]]\nat_s = 0", "kind is missing"},
        {"[[fault]]\nkind = \"late\"\nvalue = -3\nat_s = 0", "VALUE is a number from 0 to 3600"},
        {"[[fault]]\nkind = \"open\"\nunit = 1\nat_s = 0", "a sensor fault acts on T1"},
        {"[[fault]]\nkind = \"open\"\nunit = 1\nchannel = \"T1\"\nat_s = 0", "both unit and channel"},
        {"[[fault]]\nkind = \"late\"\nunit = 1e308\nat_s = 0",
         "night.toml:3: unit; accepted: a whole number"},
        {"[[fault]]\nkind = \"late\"\nvalue = \"x\"\nat_s = 0", "value; accepted: a number"},
        {"[[fault]]\nkind = \"open\"\nchannel = 7\nat_s = 0", "channel; accepted"},
        {"fault = 3", "night.toml:1: 'fault'; accepted: [[fault]] tables"},
        {"[[fault]", "night.toml:1: "},
    };
    for (const auto& [text, complaint] : wrong) {
        const auto faults = parse_scenario(text, "night.toml");
        ASSERT_FALSE(faults) << text;
        EXPECT_EQ(faults.error().next, NextStep::refuse_input);
        EXPECT_THAT(faults.error().message, HasSubstr(complaint));
    }
}

TEST(Scenario, AnEmptyOneIsNoFault) {
    EXPECT_TRUE(parse_scenario("", "empty.toml")->empty());
}

}  // namespace
}  // namespace thermbal
