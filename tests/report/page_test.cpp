#include "report/page.hpp"

#include <gtest/gtest.h>

#include "report/html.hpp"
#include "report/test_report.hpp"

namespace thermbal {
namespace {

TEST(Html, EscapesWhatHasAMeaning) {
    EXPECT_EQ(escaped("<a href=\"x\" title='y'>&"), "&lt;a href=&quot;x&quot; title=&#39;y&#39;&gt;&amp;");
}

TEST(Page, DataCannotEndItsScript) {
    Page page("x");
    page.add_table({"</script><b>", "min", {0.0, 1.0}, {{"<!--", {1.0, 2.0}}}});
    page.add(page.figure(
        {.id = "p", .title = "x", .table = "</script><b>", .unit = "C", .lines = {{"<!--", "<!--"}}}));
    const std::string html = page.html();
    EXPECT_EQ(html.find("</script><b>"), std::string::npos);
    EXPECT_EQ(html.find("\"<!--"), std::string::npos);
    EXPECT_NE(html.find("\\u003c/script>\\u003cb>"), std::string::npos);
}

TEST(Page, SurvivesANameThatIsNoUtf8) {
    Page page("\xff");
    page.add_table({"t", "min", {0.0}, {{"\xff", {1.0}}}});
    page.add(
        page.figure({.id = "p", .title = "\xff", .table = "t", .unit = "C", .lines = {{"\xff", "\xff"}}}));
    EXPECT_NE(page.html().find("</html>"), std::string::npos);
}

ReportChannel declared(const std::string& name, double known_min, double balance_min, double half_C) {
    ChannelVerdict verdict;
    verdict.channel = name;
    verdict.state = ChannelState::declared;
    verdict.declared_at_min = known_min;
    verdict.steady_state_C = 25.0;
    verdict.steady_state_low_C = 25.0 - half_C;
    verdict.steady_state_high_C = 25.0 + half_C;
    verdict.equilibrium_time_min = balance_min;
    return {.name = name, .verdict = verdict};
}

TEST(TestAnswer, IsOfTheSlowestAndTheLastAndTheWidest) {
    TestReport report;
    report.channels = {{.name = "T1", .is_ambient = true},
                       declared("T2", 90.0, 120.0, 0.1),
                       declared("T3", 80.0, 240.0, 0.2)};
    const TestAnswer answer = answer_of(report);
    EXPECT_EQ(answer.kind, TestAnswer::Kind::declared);
    EXPECT_EQ(answer.waited_for, 2U);
    EXPECT_EQ(answer.slowest, "T3");
    EXPECT_DOUBLE_EQ(answer.balance_min, 240.0);
    EXPECT_DOUBLE_EQ(answer.known_min, 90.0);
    EXPECT_DOUBLE_EQ(answer.saved_min(), 150.0);
    EXPECT_NEAR(answer.widest_half_C, 0.2, 1e-12);
}

TEST(TestAnswer, IsOpenWhileARequiredChannelIsNotDeclared) {
    TestReport report;
    report.channels = {declared("T2", 90.0, 120.0, 0.1), {.name = "T3"}, {.name = "T4", .required = false}};
    const TestAnswer answer = answer_of(report);
    EXPECT_EQ(answer.kind, TestAnswer::Kind::open);
    ASSERT_EQ(answer.undecided.size(), 1U);
    EXPECT_EQ(answer.undecided[0], "T3: not identified yet");
    EXPECT_EQ(answer_of(TestReport{}).kind, TestAnswer::Kind::none);
}

TEST(TestReport, OfNothingIsStillAPage) {
    TestReport report;
    report.source = "empty.csv";
    EXPECT_NE(report_to_html(report).find("is not known"), std::string::npos);
    EXPECT_EQ(report_to_json(report).at("answer").at("kind"), "none");
}

TEST(TestReport, HasNoColumnThatNothingStandsIn) {
    TestReport report;
    report.channels = {{.name = "T1"}, {.name = "T2"}};
    const std::string of_a_recording = report_to_html(report);
    EXPECT_EQ(of_a_recording.find("read at"), std::string::npos);
    EXPECT_EQ(of_a_recording.find(">calibration<"), std::string::npos);
    report.channels[1].source = "unit 1, input 2";
    report.channels[1].calibration = "offset 0.1";
    const std::string of_a_daemon = report_to_html(report);
    EXPECT_NE(of_a_daemon.find("read at"), std::string::npos);
    EXPECT_NE(of_a_daemon.find("unit 1, input 2"), std::string::npos);
    EXPECT_NE(of_a_daemon.find("offset 0.1"), std::string::npos);
}

}  // namespace
}  // namespace thermbal
