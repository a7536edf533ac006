#include "service/hooks.hpp"

#include <csignal>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <poll.h>

#include "support.hpp"

namespace thermbal::test {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

class HooksTest : public ::testing::Test {
  protected:
    HookResult run(Hook hook) {
        HookResult outcome;
        bool done = false;
        const auto started = runner.run(hook, [&](const HookResult& result) {
            outcome = result;
            done = true;
        });
        EXPECT_TRUE(started) << started.error().message;
        wait_until(done);
        return outcome;
    }
    void wait_until(const bool& done) {
        for (int i = 0; i < 200 && !done; ++i) {
            pollfd waiting{runner.fd(), POLLIN, 0};
            if (poll(&waiting, 1, 50) > 0) runner.dispatch();
        }
        EXPECT_TRUE(done);
    }
    std::string written() const {
        std::ifstream file(folder / "out");
        std::ostringstream text;
        text << file.rdbuf();
        return text.str();
    }
    Hook shell(const std::string& script) const {
        return {{"sh", "-c", script, "hook", (folder / "out").string()}, {}, 5s};
    }

    Folder folder;
    HookRunner runner = std::move(*HookRunner::create());
};

TEST_F(HooksTest, RunsWithItsVariablesAndArgumentsAsTheyAre) {
    auto hook = shell("printf '%s|%s' \"$THERMBAL_TEST_ID\" \"$2\" > \"$1\"");
    hook.argv.emplace_back("$(touch /tmp/x); a \"b\"");
    hook.environment = {{"THERMBAL_TEST_ID", "17"}, {"PATH", "/usr/bin:/bin"}};
    const auto result = run(hook);
    EXPECT_TRUE(result.succeeded());
    EXPECT_EQ(written(), "17|$(touch /tmp/x); a \"b\"");
    EXPECT_EQ(runner.running(), 0U);
}

TEST_F(HooksTest, TellsHowItEnded) {
    const auto status = run(shell("exit 3"));
    EXPECT_EQ(status.exit_status, 3);
    EXPECT_EQ(status.describe(), "exited with status 3");
    const auto signal = run(shell("kill -9 $$"));
    EXPECT_EQ(signal.exit_status, std::nullopt);
    EXPECT_EQ(signal.signal, SIGKILL);
    EXPECT_FALSE(signal.succeeded());
}

TEST_F(HooksTest, ACommandThatIsNotThereIsRefusedAtOnce) {
    const auto result = runner.run({{"/nonexistent/stop-spindle"}, {}, 1s}, {});
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().next, NextStep::refuse_input);
    EXPECT_THAT(result.error().message, HasSubstr("/nonexistent/stop-spindle"));
    EXPECT_FALSE(runner.run({}, {}));
}

TEST_F(HooksTest, ACommandThatHangsIsEndedWithItsChildren) {
    auto hook = shell("sleep 1000 & echo $! > \"$1\"; wait");
    hook.timeout = 300ms;
    const auto result = run(hook);
    EXPECT_TRUE(result.timed_out);
    EXPECT_EQ(result.signal, SIGTERM);
    EXPECT_THAT(result.describe(), HasSubstr("after its time limit"));
    const auto grandchild = std::stoi(written());
    // Gone, or a zombie that waits for an init that reaps.
    std::string state;
    for (int i = 0; i < 100; ++i) {
        std::ifstream stat("/proc/" + std::to_string(grandchild) + "/stat");
        std::string pid;
        std::string name;
        state.clear();
        stat >> pid >> name >> state;
        if (state.empty() || state == "Z") break;
        usleep(10'000);
    }
    EXPECT_TRUE(state.empty() || state == "Z") << state;
}

TEST_F(HooksTest, ACommandThatIgnoresTheRequestIsKilled) {
    auto hook = shell("trap '' TERM; while :; do sleep 0.1; done");
    hook.timeout = 200ms;
    const auto result = run(hook);
    EXPECT_TRUE(result.timed_out);
    EXPECT_EQ(result.signal, SIGKILL);
}

TEST_F(HooksTest, InheritsNoDescriptorAndNoSignalMask) {
    const int leaky = open("/dev/null", O_RDONLY);
    sigset_t blocked;
    sigemptyset(&blocked);
    sigaddset(&blocked, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
    const auto result =
        run(shell("grep SigBlk /proc/self/status > \"$1\"; ls /proc/$$/fd | wc -l >> \"$1\""));
    pthread_sigmask(SIG_UNBLOCK, &blocked, nullptr);
    close(leaky);
    EXPECT_TRUE(result.succeeded());
    EXPECT_THAT(written(), HasSubstr("SigBlk:\t0000000000000000\n3\n"));
}

TEST_F(HooksTest, SeveralRunBesideEachOther) {
    int ended = 0;
    bool all = false;
    for (int i = 0; i < 10; ++i)
        ASSERT_TRUE(runner.run(shell("sleep 0.3"), [&](const HookResult& result) {
            EXPECT_TRUE(result.succeeded());
            all = ++ended == 10;
        }));
    EXPECT_EQ(runner.running(), 10U);
    const auto before = std::chrono::steady_clock::now();
    wait_until(all);
    EXPECT_LT(std::chrono::steady_clock::now() - before, 2500ms) << "one after the other would take 3 s";
}

}  // namespace
}  // namespace thermbal::test
