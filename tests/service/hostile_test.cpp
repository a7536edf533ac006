#include <chrono>
#include <random>

#include <gmock/gmock.h>
#include <grp.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include "support.hpp"

namespace thermbal::test {
namespace {

using ::testing::HasSubstr;
using namespace std::chrono_literals;

class HostileTest : public ::testing::Test {
  protected:
    SocketServerOptions options() const {
        SocketServerOptions made;
        made.path = path;
        made.max_requests_per_50_ms =
            1'000'000;  // where nothing else is said: these tests have no time to wait
        return made;
    }
    bool answers() const {
        return LineClient(path).ask(R"({"jsonrpc":"2.0","id":1,"method":"echo"})").contains("result");
    }

    Folder folder;
    std::filesystem::path path = folder / "thermbald.sock";
};

/// Half of the lines are noise, half are requests with something changed in them.
std::string random_line(std::mt19937& random) {
    const auto number = [&](int most) { return std::uniform_int_distribution<int>(0, most)(random); };
    std::string line;
    if (number(1) == 0) {
        for (int left = number(200); left > 0; --left) line += static_cast<char>(number(255));
    } else {
        line = R"({"jsonrpc":"2.0","id":1,"method":"number","params":{"n":[1,2,"x",null,{"a":1e9}]}})";
        for (int changes = number(6); changes > 0; --changes) {
            const auto at = static_cast<std::size_t>(number(static_cast<int>(line.size()) - 1));
            switch (number(2)) {
                case 0:
                    line[at] = static_cast<char>(number(255));
                    break;
                case 1:
                    line.erase(at, 1);
                    break;
                default:
                    line.insert(at, line.substr(at, static_cast<std::size_t>(number(20))));
                    break;
            }
            if (line.empty()) line.push_back('{');
        }
    }
    std::erase(line, '\n');
    return line + "\n";
}

TEST_F(HostileTest, TenThousandBrokenLinesAreAnsweredWithErrors) {
    const RunningServer server(options());
    const auto seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    LineClient client(path);
    for (int batch = 0; batch < 100; ++batch) {
        std::string lines;
        for (int i = 0; i < 100; ++i) lines += random_line(random);
        lines += "{\"jsonrpc\":\"2.0\",\"id\":\"end\",\"method\":\"echo\"}\n";
        ASSERT_TRUE(client.send(lines));
        for (;;) {
            const auto line = client.line();
            ASSERT_TRUE(line.has_value()) << "the server gave no more answers";
            const auto reply = json::parse(*line);
            if (reply["id"] == "end" && reply.contains("result")) break;
        }
    }
    EXPECT_TRUE(answers());
}

TEST_F(HostileTest, RequestsAboveTheRateWaitAndNobodyElseDoes) {
    auto slow = options();
    slow.max_requests_per_50_ms = 20;
    const RunningServer server(slow);
    LineClient greedy(path);
    LineClient modest(path);
    std::string lines;
    for (int i = 0; i < 200; ++i)
        lines += R"({"jsonrpc":"2.0","id":)" + std::to_string(i) + R"(,"method":"echo"})" + "\n";
    const auto before = std::chrono::steady_clock::now();
    ASSERT_TRUE(greedy.send(lines));
    EXPECT_EQ(modest.ask(R"({"jsonrpc":"2.0","id":1,"method":"echo"})")["id"], 1);
    EXPECT_LT(std::chrono::steady_clock::now() - before, 400ms)
        << "the modest client waits with the greedy one";
    for (int i = 0; i < 200; ++i) {
        const auto line = greedy.line();
        ASSERT_TRUE(line.has_value()) << i;
        EXPECT_EQ(json::parse(*line)["id"], i);
    }
    // 20 at once, then 20 a step of 50 ms; the first step may be nearly over when it begins.
    EXPECT_GE(std::chrono::steady_clock::now() - before, 400ms);
    std::this_thread::sleep_for(200ms);
    const auto dispatches = server.dispatches.load();
    std::this_thread::sleep_for(200ms);
    EXPECT_EQ(server.dispatches - dispatches, 0U) << "the loop wakes up though nobody asks";
}

TEST_F(HostileTest, DeepNestingIsRefusedBeforeAnythingRecurses) {
    const RunningServer server(options());
    LineClient client(path);
    const std::string deep(30'000, '[');
    EXPECT_EQ(client.ask(deep + std::string(30'000, ']'))["error"]["code"], -32700);
    EXPECT_EQ(
        client.ask(
            R"({"jsonrpc":"2.0","id":1,"method":"echo","params":{"text":"[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[["}})")
            ["id"],
        1)
        << "brackets in a text are text";
}

TEST_F(HostileTest, ALineWithoutEndIsAnsweredAndClosed) {
    const RunningServer server(options());
    LineClient client(path);
    std::thread writing([&] { client.send(std::string(1'000'000, 'x')); });
    const auto reply = client.line();
    ASSERT_TRUE(reply.has_value());
    EXPECT_THAT(json::parse(*reply)["error"]["message"].get<std::string>(), HasSubstr("at most 65536 bytes"));
    EXPECT_TRUE(client.closed_by_server());
    writing.join();
    EXPECT_TRUE(answers());
}

TEST_F(HostileTest, AReplyThatIsTooLargeSaysSo) {
    const RunningServer server(options());
    LineClient client(path);
    const auto reply = client.ask(R"({"jsonrpc":"2.0","id":1,"method":"large","params":{"bytes":20000000}})");
    EXPECT_EQ(reply["error"]["code"], -32002);
    EXPECT_EQ(client.ask(R"({"jsonrpc":"2.0","id":1,"method":"large","params":{"bytes":5000000}})")["result"]
                  .get_ref<const std::string&>()
                  .size(),
              5'000'000U);
}

TEST_F(HostileTest, ASubscriberThatDoesNotReadIsDroppedAndCostsNobodyAnything) {
    auto small = options();
    small.max_backlog_bytes = 100'000;
    const RunningServer server(small);
    LineClient slow(path);
    LineClient quick(path);
    LineClient publisher(path);
    slow.ask(R"({"jsonrpc":"2.0","id":1,"method":"subscribe"})");
    quick.ask(R"({"jsonrpc":"2.0","id":1,"method":"subscribe"})");
    const std::string publish =
        R"({"jsonrpc":"2.0","id":2,"method":"publish","params":{"topic":"scan","params":")" +
        std::string(1000, 'x') + "\"}}";
    auto slowest = 0ms;
    for (int i = 0; i < 2000; ++i) {
        const auto before = std::chrono::steady_clock::now();
        ASSERT_TRUE(publisher.ask(publish).contains("result"));
        slowest = std::max(slowest, std::chrono::duration_cast<std::chrono::milliseconds>(
                                        std::chrono::steady_clock::now() - before));
        ASSERT_TRUE(quick.line().has_value());
    }
    EXPECT_LT(slowest, 1000ms) << "nobody waits for the slow one";
    const auto counters = publisher.ask(R"({"jsonrpc":"2.0","id":3,"method":"counters"})")["result"];
    EXPECT_EQ(counters["dropped"], 1);
    EXPECT_EQ(counters["subscribers"], 1);
    EXPECT_EQ(counters["clients"], 2);
    EXPECT_TRUE(slow.closed_by_server());
}

TEST_F(HostileTest, ANotificationLongerThanTheBacklogReachesWhoReads) {
    auto small = options();
    small.max_backlog_bytes = 1000;
    const RunningServer server(small);
    LineClient subscriber(path);
    LineClient publisher(path);
    subscriber.ask(R"({"jsonrpc":"2.0","id":1,"method":"subscribe"})");
    const std::string publish =
        R"({"jsonrpc":"2.0","id":2,"method":"publish","params":{"topic":"predictions","params":")" +
        std::string(50'000, 'x') + "\"}}";
    for (int i = 0; i < 5; ++i) {
        ASSERT_TRUE(publisher.ask(publish).contains("result"));
        const auto line = subscriber.line();
        ASSERT_TRUE(line.has_value());
        EXPECT_GT(line->size(), 50'000U);
    }
}

TEST_F(HostileTest, AClientThatNeverReadsItsRepliesKeepsTheLoopIdle) {
    const RunningServer server(options());
    LineClient client(path);
    std::thread writing([&] {
        for (int i = 0; i < 200; ++i)
            if (!client.send(R"({"jsonrpc":"2.0","id":1,"method":"large","params":{"bytes":60000}})"
                             "\n"))
                return;
    });
    writing.join();
    std::this_thread::sleep_for(100ms);
    const auto before = server.dispatches.load();
    std::this_thread::sleep_for(200ms);
    EXPECT_LT(server.dispatches - before, 5U) << "the loop spins";
    EXPECT_TRUE(answers());
}

TEST_F(HostileTest, ClientsThatVanishAreForgotten) {
    const RunningServer server(options());
    for (int i = 0; i < 300; ++i) {
        const LineClient client(path);
        client.send(R"({"jsonrpc":"2.0","id":1,"method":"large","params":{"bytes":300000}})"
                    "\n{\"half");
    }
    // The first ones may still find the places taken by those that the server has not yet seen leave.
    json reply;
    for (int i = 0; i < 100; ++i) {
        std::this_thread::sleep_for(10ms);
        reply = LineClient(path).ask(R"({"jsonrpc":"2.0","id":3,"method":"counters"})");
        if (reply.is_object() && reply.contains("result") && reply["result"]["clients"] == 1) break;
    }
    ASSERT_TRUE(reply.is_object() && reply.contains("result")) << reply;
    const auto counters = reply["result"];
    EXPECT_EQ(counters["clients"], 1);
    const auto before = server.dispatches.load();
    std::this_thread::sleep_for(200ms);
    EXPECT_LT(server.dispatches - before, 5U) << "the loop spins";
}

TEST_F(HostileTest, TooManyClientsAreToldSoAndTheOthersGoOn) {
    const RunningServer server(options());
    std::vector<LineClient> clients;
    for (std::size_t i = 0; i < options().max_clients; ++i) {
        clients.emplace_back(path);
        ASSERT_TRUE(clients.back().ask(R"({"jsonrpc":"2.0","id":1,"method":"echo"})").contains("result"))
            << i;
    }
    LineClient extra(path);
    const auto refusal = extra.line();
    ASSERT_TRUE(refusal.has_value());
    EXPECT_THAT(*refusal, HasSubstr("too many clients"));
    EXPECT_TRUE(extra.closed_by_server());
    for (auto& client : clients)
        EXPECT_TRUE(client.ask(R"({"jsonrpc":"2.0","id":2,"method":"echo"})").contains("result"));
    clients.clear();
    std::this_thread::sleep_for(50ms);
    EXPECT_TRUE(answers());
}

TEST_F(HostileTest, OneUserCannotTakeAllPlaces) {
    if (geteuid() != 0) GTEST_SKIP() << "needs root to become another user";
    ASSERT_EQ(chmod(folder.path().c_str(), 0755), 0);
    const RunningServer server(options());
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
        if (setgroups(0, nullptr) != 0 || setgid(65534) != 0 || setuid(65534) != 0) _exit(3);
        std::vector<LineClient> clients;
        for (int i = 0; i < 60; ++i) clients.emplace_back(path);
        const bool last_refused = clients.back().closed_by_server();
        const char answer = last_refused ? 'y' : 'n';
        if (write(ends[1], &answer, 1) != 1) _exit(4);
        pause();
    }
    char answer = '?';
    ASSERT_EQ(read(ends[0], &answer, 1), 1);
    EXPECT_EQ(answer, 'y');
    EXPECT_TRUE(answers()) << "root still finds a place";
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    close(ends[0]);
    close(ends[1]);
}

TEST_F(HostileTest, WithoutDescriptorsTheLoopDoesNotSpin) {
    const pid_t child = fork();
    if (child == 0) {
        auto many = options();
        many.max_clients = 1000;
        RunningServer server(many);
        rlimit limit{};
        getrlimit(RLIMIT_NOFILE, &limit);
        // In this process both ends count; the last connections get a client end and no server end.
        const int next_free = dup(0);
        close(next_free);
        limit.rlim_cur = static_cast<rlim_t>(next_free) + 21;
        setrlimit(RLIMIT_NOFILE, &limit);
        std::vector<LineClient> clients;
        try {
            for (;;) {
                clients.emplace_back(path);
                std::this_thread::sleep_for(2ms);
            }
        } catch (const std::runtime_error&) {
            std::this_thread::sleep_for(50ms);
        }
        const auto before = server.dispatches.load();
        std::this_thread::sleep_for(200ms);
        if (server.dispatches - before > 5) _exit(1);
        clients.clear();
        std::this_thread::sleep_for(50ms);
        _exit(answers() ? 0 : 2);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace thermbal::test
