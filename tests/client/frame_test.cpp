#include <regex>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "answers.hpp"
#include "channel_columns.hpp"
#include "columns.hpp"
#include "fields.hpp"
#include "scenes.hpp"
#include "watch_frame.hpp"

namespace thermbal::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;
using Page = WatchScene::Page;

std::vector<std::string> lines_of(const std::string& frame) {
    std::vector<std::string> lines(1);
    for (const char c : frame) {
        if (c == '\n') {
            lines.emplace_back();
        } else {
            lines.back() += c;
        }
    }
    return lines;
}

std::string without_colours(const std::string& line) {
    static const std::regex colours("\x1b\\[[0-9;]*m");
    return std::regex_replace(line, colours, "");
}

class Frame : public ::testing::Test {
  protected:
    void SetUp() override { use_utf8(); }
    WatchScene scene = busy_scene();
};

TEST_F(Frame, NoFrameIsLargerThanItsScreen) {
    for (const Page page : {Page::channels, Page::channel, Page::events, Page::help}) {
        scene.page = page;
        scene.chosen = page == Page::channel ? std::optional<std::size_t>(15) : std::nullopt;
        for (const std::size_t columns : {1U, 7U, 20U, 40U, 79U, 80U, 81U, 97U, 100U, 132U, 160U, 250U}) {
            for (const std::size_t rows : {1U, 2U, 3U, 10U, 19U, 23U, 24U, 25U, 40U, 100U}) {
                for (const FrameLook look : {FrameLook{true, true}, FrameLook{false, false}}) {
                    const auto lines = lines_of(render_frame(scene, {rows, columns}, look));
                    ASSERT_EQ(lines.size(), rows) << columns << "x" << rows;
                    for (const std::string& line : lines) {
                        const std::string plain = without_colours(line);
                        ASSERT_LE(display_width(plain), columns) << columns << "x" << rows << ": " << plain;
                        ASSERT_EQ(plain, printable(plain));
                    }
                }
            }
        }
    }
}

TEST_F(Frame, AllChannelsAndEventsAreOnTheSmallestUsualScreen) {
    const auto lines = lines_of(render_frame(scene, {24, 80}, {false, true}));
    EXPECT_EQ(lines[0].substr(0, 34), " thermbal  test 12 \"idle 5000 r/mi");
    EXPECT_THAT(lines[0], HasSubstr("running  62.25 min  250 scans"));
    EXPECT_THAT(lines[1], HasSubstr("7 of 14"));
    for (std::size_t i = 1; i <= 16; ++i)
        EXPECT_EQ(lines[2 + i].substr(0, 3), left_aligned(fmt::format("T{}", i), 3));
    EXPECT_EQ(lines[7], "T5    25.00  +7.00   +0.0 ▁ ▃▄▆▇█ 20 0.100  26.74 26.61..26.88  68 min declared ");
    EXPECT_THAT(lines[22], HasSubstr("remark 59"));
    EXPECT_THAT(lines[23], HasSubstr("q quit"));
}

TEST_F(Frame, ATestWithAModelShowsEachResidualAndWhichCannotBeChance) {
    EXPECT_THAT(render_frame(scene, {24, 80}, {false, true}), Not(HasSubstr("resid")));
    for (auto& channel : scene.channels["channels"]) {
        if (channel["channel"] == "T1") continue;
        channel["simulated_C"] = 24.2;
        channel["residual_C"] = channel["channel"] == "T5" ? 0.84 : -0.03;
        channel["disagrees"] = channel["channel"] == "T5";
    }
    const auto lines = lines_of(render_frame(scene, {24, 80}, {false, true}));
    EXPECT_THAT(lines[2], HasSubstr("resid C"));
    EXPECT_THAT(lines[2 + 5], HasSubstr("+0.84"));
    EXPECT_THAT(lines[2 + 5], HasSubstr("declared"));
    EXPECT_THAT(lines[2 + 6], HasSubstr("-0.03"));
    for (const std::string& line : lines) EXPECT_LE(display_width(line), 80U);
    const auto coloured = lines_of(render_frame(scene, {24, 80}, {true, true}));
    EXPECT_THAT(coloured[2 + 5], HasSubstr("\x1b[1;31m  +0.84"));
    scene.page = Page::channel;
    scene.chosen = 4;
    EXPECT_THAT(render_frame(scene, {24, 80}, {false, true}),
                HasSubstr("24.20 C   measured is +0.84 C off: more than noise and model allow"));
}

TEST_F(Frame, AReadingThatIsNotGoodShowsItsQualityAndNoNumber) {
    const auto lines = lines_of(render_frame(scene, {24, 80}, {false, true}));
    EXPECT_EQ(lines[2 + 9].substr(0, 11), "T9     open");
    EXPECT_EQ(lines[2 + 10].substr(0, 11), "T10 no link");
    EXPECT_THAT(lines[2 + 9], Not(HasSubstr("29.00")));
}

TEST_F(Frame, ANumberIsNeverClippedToAnother) {
    // A clipped -1126.61 could read as another temperature; without room for digits it loses precision
    // instead.
    const auto lines = lines_of(render_frame(scene, {24, 80}, {false, true}));
    EXPECT_THAT(lines[2 + 16], HasSubstr("-1127..1127"));
    EXPECT_THAT(lines[2 + 16], HasSubstr("-123.46"));
}

TEST_F(Frame, WideScreensShowPlaceAndReason) {
    const std::string narrow = render_frame(scene, {24, 80}, {false, true});
    const std::string wide = render_frame(scene, {24, 160}, {false, true});
    EXPECT_THAT(narrow, Not(HasSubstr("front bearing")));
    EXPECT_THAT(wide, HasSubstr("front bearing"));
    EXPECT_THAT(wide, HasSubstr("0.31 C wide"));
}

TEST_F(Frame, NarrowScreensKeepNameValuePredictionAndState) {
    std::vector<std::string> titles;
    for (const ChannelColumn& column : fitting_columns(list(scene.channels, "channels"), 30, true))
        titles.push_back(column.title);
    EXPECT_THAT(titles, ::testing::ElementsAre("", "value C", "steady", "state"));
}

TEST_F(Frame, ShortScreensScrollToTheChosenChannel) {
    scene.chosen = 15;
    const std::string frame = render_frame(scene, {10, 80}, {false, true});
    EXPECT_THAT(frame, HasSubstr("\nT16 "));
    EXPECT_THAT(frame, Not(HasSubstr("\nT2 ")));
}

TEST_F(Frame, ColoursAreOnlyWhereTheyAreWanted) {
    EXPECT_THAT(render_frame(scene, {24, 80}, {false, true}), Not(HasSubstr("\x1b")));
    const auto lines = lines_of(render_frame(scene, {24, 80}, {true, true}));
    EXPECT_THAT(lines[2 + 5], HasSubstr("\x1b[1;32mdeclared"));
    EXPECT_THAT(lines[2 + 9], HasSubstr("\x1b[1;31m   open"));
    for (const std::string& line : lines) {
        const auto last = line.rfind('\x1b');
        EXPECT_TRUE(last == std::string::npos || line.substr(last, 4) == "\x1b[0m") << line;
    }
}

TEST_F(Frame, OldFiguresSayThatTheyAreOld) {
    EXPECT_THAT(render_frame(scene, {24, 80}, {false, true}), Not(HasSubstr("no scan for")));
    scene.scan_age_s = 61.0;
    EXPECT_THAT(render_frame(scene, {24, 80}, {false, true}), HasSubstr("no scan for 61 s"));
    scene.trouble = "thermbald is away for 12 s";
    EXPECT_THAT(render_frame(scene, {24, 80}, {false, true}), HasSubstr("thermbald is away for 12 s"));
}

TEST_F(Frame, ADaemonThatSaysNothingUsefulIsShownWithoutFigures) {
    for (const json& odd :
         {json(), json("x"), json{{"channels", {1, "a", nullptr, {{"channel", 7}, {"n", "x"}}}}}}) {
        WatchScene strange;
        strange.status = odd;
        strange.channels = odd;
        strange.curve = odd;
        strange.events = {odd, json(7)};
        for (const Page page : {Page::channels, Page::channel, Page::events, Page::help}) {
            strange.page = page;
            EXPECT_THAT(render_frame(strange, {24, 80}, {true, true}), HasSubstr("thermbal"));
        }
    }
}

TEST_F(Frame, TheChannelPageDrawsTheCurveWithItsMinimum) {
    scene.page = Page::channel;
    scene.chosen = 4;
    const auto lines = lines_of(render_frame(scene, {30, 120}, {true, true}));
    const auto axis = std::ranges::find_if(
        lines, [](const std::string& line) { return without_colours(line).starts_with("      n = "); });
    ASSERT_NE(axis, lines.end());
    // The chart stands on the axis: a block for each n with a figure, none for the missing 34, and the
    // minimum in ink.
    const std::string bottom = *(axis - 1);
    EXPECT_THAT(bottom, HasSubstr("\x1b[1;32m"));
    const std::string plain = without_colours(bottom);
    EXPECT_EQ(std::ranges::count(plain, '\xe2'), 1 + 34 * 2);  // the axis, and 34 bars of 2 columns
}

TEST_F(Frame, TheChannelPageShowsWhereTheCourseGoes) {
    scene.page = Page::channel;
    scene.chosen = 4;
    const auto has_goal = [&] {
        return std::ranges::any_of(
            lines_of(render_frame(scene, {30, 120}, {false, true})), [](const std::string& line) {
                return line.find("│") != std::string::npos && line.find("░") != std::string::npos;
            });
    };
    EXPECT_TRUE(has_goal());
    for (json& channel : scene.channels["channels"])
        channel["steady_state_low_C"] = channel["steady_state_high_C"] = nullptr;
    EXPECT_FALSE(has_goal());
}

TEST_F(Frame, HelpNamesTheKeysAndFitsTheSmallestUsualScreen) {
    scene.page = Page::help;
    const std::string help = render_frame(scene, {24, 80}, {false, true});
    for (const char* key : {"up/down", "Enter", "Esc", "q ", "e "}) EXPECT_THAT(help, HasSubstr(key));
    EXPECT_THAT(help, Not(HasSubstr("~")));
    EXPECT_THAT(render_frame(scene, {24, 80}, {true, true}), HasSubstr("\x1b["));
}

TEST_F(Frame, OlderEventsAreReachedByScrolling) {
    scene.page = Page::events;
    const std::string newest = event_message(scene.events.back());
    EXPECT_THAT(render_frame(scene, {24, 160}, {false, true}), HasSubstr(newest));
    scene.events_back = 1;
    const std::string scrolled = render_frame(scene, {24, 160}, {false, true});
    EXPECT_THAT(scrolled, Not(HasSubstr(newest)));
    EXPECT_THAT(scrolled, HasSubstr("1 newer below"));
    scene.events_back = 1000;  // further than there is: an empty page, not a crash
    EXPECT_THAT(render_frame(scene, {24, 160}, {false, true}), HasSubstr("events"));
}

TEST_F(Frame, ALineForEachScan) {
    const std::string line = scan_line(scene.channels, scene.status);
    EXPECT_THAT(line, HasSubstr("62.25 min T1=21.00 T2=22.00"));
    EXPECT_THAT(line, HasSubstr(" T9=open T10=communication T11=31.00"));
    EXPECT_THAT(line, ::testing::EndsWith(" T16=-123.46 running, 7 of 14 declared"));
}

TEST_F(Frame, WhatHardlyWarmsIsNotWaitedFor) {
    const DeclaredCount count = count_declared(scene.channels);
    EXPECT_EQ(count.declared, 7U);
    EXPECT_EQ(count.required, 14U);
}

}  // namespace
}  // namespace thermbal::test
