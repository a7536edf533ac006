#include <csignal>
#include <cstdio>
#include <fstream>

#include <gmock/gmock.h>
#include <grp.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include "name_service.hpp"
#include "service/socket_server.hpp"
#include "support.hpp"

namespace thermbal::test {
namespace {

using ::testing::HasSubstr;

class SocketTest : public ::testing::Test {
  protected:
    SocketServerOptions options() const {
        SocketServerOptions made;
        made.path = path;
        return made;
    }
    Folder folder;
    std::filesystem::path path = folder / "thermbald.sock";
};

std::string output_of(const std::string& command) {
    std::string text;
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
    std::array<char, 4096> buffer;
    while (const auto count = fread(buffer.data(), 1, buffer.size(), pipe.get()))
        text.append(buffer.data(), count);
    return text;
}

TEST_F(SocketTest, AnswersNetcat) {
    if (!std::filesystem::exists("/usr/bin/nc")) GTEST_SKIP() << "no nc here";
    const RunningServer server(options());
    const auto reply = output_of(
        "printf '{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"echo\",\"params\":{\"a\":[1]}}\\n' | "
        "timeout 2 nc -U " +
        path.string());
    EXPECT_EQ(reply, "{\"id\":1,\"jsonrpc\":\"2.0\",\"result\":{\"a\":[1]}}\n");
}

TEST_F(SocketTest, ErrorsHaveTheCodesOfTheSpecification) {
    const RunningServer server(options());
    LineClient client(path);
    const auto code = [&](std::string_view request) { return client.ask(request)["error"]["code"]; };
    EXPECT_EQ(code("{"), -32700);
    EXPECT_EQ(code("\"\xff\xfe\""), -32700);
    EXPECT_EQ(code("7"), -32600);
    EXPECT_EQ(code("{}"), -32600);
    EXPECT_EQ(code(R"({"jsonrpc":"1.0","id":1,"method":"echo"})"), -32600);
    EXPECT_EQ(code(R"({"jsonrpc":"2.0","id":1,"method":7})"), -32600);
    EXPECT_EQ(code(R"({"jsonrpc":"2.0","id":{},"method":"echo"})"), -32600);
    EXPECT_EQ(code(R"([{"jsonrpc":"2.0","id":1,"method":"echo"}])"), -32600);
    EXPECT_EQ(code(R"({"jsonrpc":"2.0","id":1,"method":"nothing"})"), -32601);
    EXPECT_EQ(code(R"({"jsonrpc":"2.0","id":1,"method":"echo","params":[1]})"), -32602);
    EXPECT_EQ(code(R"({"jsonrpc":"2.0","id":1,"method":"number","params":{"n":"seven"}})"), -32602);
    EXPECT_EQ(code(R"({"jsonrpc":"2.0","id":1,"method":"number"})"), -32602);
    EXPECT_EQ(code(R"({"jsonrpc":"2.0","id":1,"method":"fails"})"), -32003);
    const auto unknown = client.ask(R"({"jsonrpc":"2.0","id":"a","method":"nothing"})");
    EXPECT_EQ(unknown["id"], "a");
    EXPECT_THAT(unknown["error"]["message"].get<std::string>(), HasSubstr("echo"));
    EXPECT_EQ(client.ask(R"({"jsonrpc":"2.0","id":2,"method":"number","params":{"n":7}})")["result"], 7);
}

TEST_F(SocketTest, PipelinedRequestsAreAnsweredInOrderAndNotificationsNotAtAll) {
    const RunningServer server(options());
    LineClient client(path);
    std::string requests;
    for (int i = 0; i < 3000; ++i) {
        requests += R"({"jsonrpc":"2.0","method":"echo"})"
                    "\n";
        requests += R"({"jsonrpc":"2.0","id":)" + std::to_string(i) +
                    R"(,"method":"large","params":{"bytes":2000}})"
                    "\n";
    }
    // Written by another thread: with 6 MB of replies unread, the server takes no more requests until some
    // are read.
    std::thread writing([&] { EXPECT_TRUE(client.send(requests)); });
    for (int i = 0; i < 3000; ++i) {
        const auto line = client.line();
        ASSERT_TRUE(line.has_value()) << i;
        ASSERT_EQ(json::parse(*line)["id"], i);
    }
    writing.join();
}

TEST_F(SocketTest, ALineMayComeInPiecesAndTheLastOneWithoutItsEnd) {
    const RunningServer server(options());
    LineClient client(path);
    const std::string request = R"({"jsonrpc":"2.0","id":5,"method":"echo"})";
    for (const char c : request) {
        client.send(std::string_view(&c, 1));
        usleep(200);
    }
    client.close_sending_side();
    const auto reply = client.line();
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(json::parse(*reply)["id"], 5);
    EXPECT_TRUE(client.closed_by_server());
}

TEST_F(SocketTest, SubscribersHearTheirTopics) {
    const RunningServer server(options());
    LineClient all(path);
    LineClient scans(path);
    LineClient other(path);
    EXPECT_EQ(all.ask(R"({"jsonrpc":"2.0","id":1,"method":"subscribe"})")["result"]["subscribed"], "all");
    EXPECT_TRUE(scans.ask(R"({"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"topics":["scan"]}})")
                    .contains("result"));
    EXPECT_EQ(
        scans.ask(
            R"({"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"topics":"scan"}})")["error"]["code"],
        -32602);
    const json unknown =
        scans.ask(R"({"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"topics":["scan","scans"]}})");
    EXPECT_EQ(unknown["error"]["message"], "subscribe: no such topic; there are: event, scan");
    for (const char* topic : {"event", "scan"})
        other.ask(std::string(R"({"jsonrpc":"2.0","id":2,"method":"publish","params":{"topic":")") + topic +
                  R"(","params":{"scan":7}}})");
    EXPECT_EQ(json::parse(*all.line()),
              json::parse(R"({"jsonrpc":"2.0","method":"event","params":{"scan":7}})"));
    EXPECT_EQ(json::parse(*all.line())["method"], "scan");
    EXPECT_EQ(json::parse(*scans.line())["method"], "scan");
    EXPECT_TRUE(all.ask(R"({"jsonrpc":"2.0","id":3,"method":"unsubscribe"})").contains("result"));
    EXPECT_EQ(other.ask(R"({"jsonrpc":"2.0","id":4,"method":"counters"})")["result"]["subscribers"], 1);
}

TEST_F(SocketTest, ASubscriberThatClosesItsSendingSideStillListens) {
    const RunningServer server(options());
    LineClient listening(path);
    listening.ask(R"({"jsonrpc":"2.0","id":1,"method":"subscribe"})");
    listening.close_sending_side();
    LineClient other(path);
    other.ask(R"({"jsonrpc":"2.0","id":2,"method":"publish","params":{"topic":"scan","params":{}}})");
    EXPECT_TRUE(listening.line().has_value());
}

TEST_F(SocketTest, TheKernelSaysWhoAsks) {
    const RunningServer server(options());
    const auto who = LineClient(path).ask(R"({"jsonrpc":"2.0","id":1,"method":"whoami"})")["result"];
    EXPECT_EQ(who["uid"], geteuid());
    EXPECT_EQ(who["pid"], getpid());
}

/// The reply to stop_test, asked by a process of another user and group.
std::string stop_as(const std::filesystem::path& socket, uid_t uid, gid_t gid, std::vector<gid_t> groups) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
        if (setgroups(groups.size(), groups.data()) != 0 || setgid(gid) != 0 || setuid(uid) != 0) _exit(3);
        LineClient client(socket);
        const auto reply = client.ask(R"({"jsonrpc":"2.0","id":1,"method":"stop_test"})").dump();
        _exit(write(ends[1], reply.data(), reply.size()) > 0 ? 0 : 4);
    }
    close(ends[1]);
    std::array<char, 4096> buffer{};
    const auto count = read(ends[0], buffer.data(), buffer.size());
    close(ends[0]);
    waitpid(child, nullptr, 0);
    return {buffer.data(), count > 0 ? static_cast<std::size_t>(count) : 0};
}

TEST_F(SocketTest, OnlyOperatorsMayChangeAnything) {
    if (geteuid() != 0) GTEST_SKIP() << "needs root to become another user";
    ASSERT_EQ(chmod(folder.path().c_str(), 0755), 0);
    auto with_group = options();
    with_group.operators_group = "dialout";
    const auto dialout = getgrnam("dialout")->gr_gid;
    RunningServer server(with_group);

    const auto denied = json::parse(stop_as(path, 65534, 65534, {}));
    EXPECT_EQ(denied["error"]["code"], -32001);
    EXPECT_EQ(denied["error"]["message"],
              "stop_test: permission denied for uid 65534: only root and members of group dialout may");
    EXPECT_EQ(server.stops, 0);
    EXPECT_TRUE(json::parse(stop_as(path, 65534, 65534, {dialout})).contains("result"))
        << "supplementary group";
    EXPECT_TRUE(json::parse(stop_as(path, 65534, dialout, {})).contains("result")) << "primary group";
    EXPECT_TRUE(LineClient(path).ask(R"({"jsonrpc":"2.0","id":1,"method":"stop_test"})").contains("result"));
    EXPECT_EQ(server.stops, 3);
}

TEST_F(SocketTest, NoRequestAsksANameService) {
    if (geteuid() != 0) GTEST_SKIP() << "needs root to become another user";
    ASSERT_EQ(chmod(folder.path().c_str(), 0755), 0);
    auto with_group = options();
    with_group.operators_group = "dialout";
    const RunningServer server(with_group);
    const int at_the_start = name_service_calls();
    EXPECT_GT(at_the_start, 0);
    EXPECT_EQ(json::parse(stop_as(path, 65534, 65534, {}))["error"]["code"], -32001);
    EXPECT_EQ(server.stops, 0);
    EXPECT_EQ(name_service_calls(), at_the_start);
}

TEST_F(SocketTest, AGroupThatIsNotThereIsSaid) {
    if (geteuid() != 0) GTEST_SKIP() << "needs root to become another user";
    ASSERT_EQ(chmod(folder.path().c_str(), 0755), 0);
    auto with_group = options();
    with_group.operators_group = "no-such-group";
    const RunningServer server(with_group);
    EXPECT_THAT(stop_as(path, 65534, 65534, {}), HasSubstr("group no-such-group was not there"));
    EXPECT_EQ(server.stops, 0);
}

TEST_F(SocketTest, ANotificationNeedsPermissionToo) {
    if (geteuid() != 0) GTEST_SKIP() << "needs root to become another user";
    ASSERT_EQ(chmod(folder.path().c_str(), 0755), 0);
    RunningServer server(options());
    const pid_t child = fork();
    if (child == 0) {
        if (setgroups(0, nullptr) != 0 || setgid(65534) != 0 || setuid(65534) != 0) _exit(3);
        LineClient client(path);
        client.send(R"({"jsonrpc":"2.0","method":"stop_test"})"
                    "\n");
        _exit(client.ask(R"({"jsonrpc":"2.0","id":1,"method":"counters"})")["result"]["denied"] == 1 ? 0 : 1);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
    EXPECT_EQ(server.stops, 0);
}

TEST_F(SocketTest, TheSocketFileHasTheModeThatWasAsked) {
    auto narrow = options();
    narrow.mode = 0660;
    const RunningServer server(narrow);
    struct stat file{};
    ASSERT_EQ(stat(path.c_str(), &file), 0);
    EXPECT_EQ(file.st_mode & 0777U, 0660U);
}

TEST_F(SocketTest, AStaleFileIsReplacedALiveOneIsNot) {
    const pid_t child = fork();
    if (child == 0) {
        const auto server = SocketServer::open(options());
        _exit(server ? raise(SIGKILL) : 1);
    }
    waitpid(child, nullptr, 0);
    ASSERT_TRUE(std::filesystem::exists(path)) << "the killed server left its file";
    {
        const auto server = SocketServer::open(options());
        ASSERT_TRUE(server) << server.error().message;
        const auto second = SocketServer::open(options());
        ASSERT_FALSE(second);
        EXPECT_THAT(second.error().message, HasSubstr("another daemon answers"));
    }
    EXPECT_FALSE(std::filesystem::exists(path)) << "a server that ends removes its file";
    std::ofstream(path) << "a file of somebody's";
    const auto refused = SocketServer::open(options());
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("no socket"));
    EXPECT_TRUE(std::filesystem::exists(path));
}

TEST_F(SocketTest, TakesTheSocketThatSystemdPassed) {
    // What systemd does: bind and listen, hand it over as descriptor 3, name the process that it is for.
    const pid_t child = fork();
    if (child == 0) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
        const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
        if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 || listen(fd, 5) != 0)
            _exit(2);
        if (fd != 3) dup2(fd, 3);
        setenv("LISTEN_FDS", "1", 1);
        setenv("LISTEN_PID", std::to_string(getpid()).c_str(), 1);
        auto elsewhere = options();
        elsewhere.path = folder / "another.sock";
        bool answered = false;
        {
            const RunningServer server(elsewhere);
            answered = LineClient(path).ask(R"({"jsonrpc":"2.0","id":1,"method":"echo"})").contains("result");
        }
        const bool file_left_to_systemd = std::filesystem::exists(path);
        _exit(answered && file_left_to_systemd && !std::filesystem::exists(elsewhere.path) ? 0 : 1);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace thermbal::test
