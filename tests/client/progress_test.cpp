#include "progress.hpp"

#include <chrono>

#include <gmock/gmock.h>

namespace thermbal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ProgressLine, SaysTheShareAndTheTimeLeft) {
    EXPECT_EQ(progress_line({"replay", 30.0, 0.25, ""}, 80), "replay   25 %  00:30 so far, about 01:30 left");
    EXPECT_EQ(progress_line({"backup", 4000.0, 0.5, ""}, 80),
              "backup   50 %  1:06:40 so far, about 1:06:40 left");
}

TEST(ProgressLine, GuessesNothing) {
    EXPECT_EQ(progress_line({"verify", 12.4, std::nullopt, ""}, 80), "verify  00:12 so far");
    EXPECT_THAT(progress_line({"replay", 3.0, 0.0, ""}, 80), Not(HasSubstr("left")));
    EXPECT_THAT(progress_line({"identify", 3.0, 0.5, "step 2"}, 80), HasSubstr("identify, step 2   50 %"));
    EXPECT_THAT(progress_line({"probe", 3.0, 1.7, ""}, 80), Not(HasSubstr("left")));
}

TEST(ProgressLine, FitsIntoTheTerminal) {
    EXPECT_EQ(progress_line({"replay", 30.0, 0.25, ""}, 10), "replay   ");
    EXPECT_EQ(progress_line({"replay", 30.0, 0.25, ""}, 0), "");
}

TEST(Progress, WithoutATerminalItCostsNothingAndSaysNothing) {
    ::testing::internal::CaptureStderr();
    const auto began = std::chrono::steady_clock::now();
    int calls = 0;
    {
        Progress progress("work");
        progress.counting(sequential_for)(5, [&](std::size_t) { ++calls; });
        progress.set(0.5);
    }
    EXPECT_EQ(calls, 5);
    EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::milliseconds(500));
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace thermbal
