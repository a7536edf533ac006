#include "simulator/control.hpp"

#include <gmock/gmock.h>

namespace thermbal {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(Control, FaultsComeAndGo) {
    FaultPlan plan;
    EXPECT_EQ(obey("fault exception=6:2 30", plan, 100.0), "ok exception=6:2@100-130");
    EXPECT_EQ(obey("fault open:T3", plan, 110.0), "ok open:T3@110");
    EXPECT_EQ(obey("list", plan, 110.0), "ok exception=6:2@100-130 open:T3@110");
    EXPECT_EQ(plan.on_reply(2, 120.0)->value, 6.0);
    EXPECT_FALSE(plan.on_reply(2, 130.0));
    EXPECT_EQ(obey("clear open", plan, 0.0), "ok 1 cleared");
    EXPECT_EQ(obey("clear", plan, 0.0), "ok 1 cleared");
    EXPECT_EQ(obey("list", plan, 0.0), "ok");
    EXPECT_EQ(obey("time", plan, 42.5), "ok 42.5");
}

TEST(Control, AnythingElseIsAnErrorThatSaysWhatIsAccepted) {
    FaultPlan plan;
    for (const char* line :
         {"", "   ", "fault", "fault gone", "fault open 0", "fault open x", "fault open 1 2",
          "fault open inf", "clear gone", "clear open short", "list 3", "help"}) {
        EXPECT_THAT(obey(line, plan, 0.0), StartsWith("error ")) << line;
    }
    EXPECT_THAT(obey("stop", plan, 0.0), HasSubstr("accepted: fault KIND"));
    EXPECT_TRUE(plan.faults().empty());
}

TEST(Control, AFaultThatCouldDoNothingOnThisLineIsRefused) {
    FaultPlan plan({}, {.framing = FaultFraming::tcp, .units = {1, 2}, .channels = 8});
    EXPECT_THAT(obey("fault wrong-crc", plan, 0.0), HasSubstr("RTU only"));
    EXPECT_THAT(obey("fault late:3", plan, 0.0), HasSubstr("there are: 1, 2"));
    EXPECT_THAT(obey("fault open:T9", plan, 0.0), HasSubstr("T1 ... T8"));
    EXPECT_TRUE(plan.faults().empty());
    for (const char* line : {"fault wrong-tid:2", "fault late", "fault open:T8", "fault open"}) {
        EXPECT_THAT(obey(line, plan, 0.0), StartsWith("ok ")) << line;
    }
    FaultPlan of_a_port({}, {.framing = FaultFraming::rtu});
    EXPECT_THAT(obey("fault refuse", of_a_port, 0.0), HasSubstr("TCP only"));
}

}  // namespace
}  // namespace thermbal
