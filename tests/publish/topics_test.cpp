#include "publish/topics.hpp"

#include <gmock/gmock.h>

namespace thermbal {
namespace {

TEST(TopicLevel, ANameIsOneLevelWhateverStandsInIt) {
    EXPECT_EQ(topic_level("VMC 850"), "VMC 850");
    EXPECT_EQ(topic_level("Fräse"), "Fräse");
    EXPECT_EQ(topic_level("hall 3/VMC+#"), "hall 3%2FVMC%2B%23");
    EXPECT_EQ(topic_level("50 %"), "50 %25");
    EXPECT_EQ(topic_level("$SYS"), "%24SYS");
    EXPECT_EQ(topic_level("a$b"), "a$b");
    EXPECT_EQ(topic_level(std::string("a\0b\nc", 5)), "a%00b%0Ac");
    EXPECT_EQ(topic_level("\xff\xc3\xa4"), "%FF%C3%A4") << "no UTF-8: a broker would hang up";
    EXPECT_EQ(topic_level(""), "_");
}

TEST(Topics, ThePrefixMayHaveLevels) {
    const Topics topics("plant//hall 3/", "VMC/850");
    EXPECT_EQ(topics.samples(), "plant/hall 3/VMC%2F850/samples");
    EXPECT_EQ(topics.declarations("T5"), "plant/hall 3/VMC%2F850/declarations/T5");
    EXPECT_EQ(Topics("", "m").status(), "m/status");
}

}  // namespace
}  // namespace thermbal
