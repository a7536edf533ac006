#include "socket_client.hpp"

#include <atomic>
#include <filesystem>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include "service/socket_server.hpp"

namespace thermbal::test {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

/// The daemon's own socket server, on a thread of its own.
class Server {
  public:
    explicit Server(const std::filesystem::path& path) : server_(SocketServer::open(at(path)).value()) {
        server_.add_topics({"event"});
        server_.add_method("echo", Access::reads, [](const Request& request) { return request.params; });
        server_.add_method("busy", Access::reads, [](const Request&) -> Result<json> {
            return fail(NextStep::retry, "the database is locked");
        });
        server_.add_method("large", Access::reads,
                           [](const Request&) { return json(std::string(3'000'000, 'x')); });
        server_.add_method("publish", Access::reads, [this](const Request& request) {
            for (int i = 0; i < 3; ++i) server_.publish("event", {{"i", i}});
            return request.params;
        });
        server_.add_method("late", Access::reads, [](const Request&) {
            std::this_thread::sleep_for(milliseconds(300));
            return json("late");
        });
        thread_ = std::thread([this] {
            while (!done_) {
                pollfd waiting{server_.fd(), POLLIN, 0};
                if (poll(&waiting, 1, 20) > 0) server_.dispatch();
            }
        });
    }
    ~Server() {
        done_ = true;
        thread_.join();
    }

  private:
    static SocketServerOptions at(const std::filesystem::path& path) {
        SocketServerOptions options;
        options.path = path;
        return options;
    }
    SocketServer server_;
    std::atomic<bool> done_ = false;
    std::thread thread_;
};

class Client : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "thermbal-client-XXXXXX").string();
        folder_ = mkdtemp(name.data());
        path = folder_ / "d.sock";
        server.emplace(path);
    }
    void TearDown() override {
        server.reset();
        std::filesystem::remove_all(folder_);
    }
    std::filesystem::path path;
    std::optional<Server> server;

  private:
    std::filesystem::path folder_;
};

TEST_F(Client, AsksAndIsAnswered) {
    auto client = SocketClient::connect(path).value();
    EXPECT_EQ(client.ask("echo", {{"a", 1}}).value(), json({{"a", 1}}));
    EXPECT_EQ(client.ask("large").value().get<std::string>().size(), 3'000'000U);
    EXPECT_EQ(client.ask("echo", {{"name", "\xe4 not UTF-8"}}).value()["name"], "\xef\xbf\xbd not UTF-8");
}

TEST_F(Client, ARefusalLeavesTheConnectionInUse) {
    auto client = SocketClient::connect(path).value();
    const auto busy = client.ask("busy");
    ASSERT_FALSE(busy);
    EXPECT_EQ(busy.error().next, NextStep::retry);
    EXPECT_EQ(busy.error().message, "the database is locked");
    const auto unknown = client.ask("nothing");
    ASSERT_FALSE(unknown);
    EXPECT_THAT(unknown.error().message, HasSubstr("no such method"));
    EXPECT_TRUE(client.ask("echo"));
}

TEST_F(Client, NotificationsThatComeBetweenAreKeptInTheirOrder) {
    auto client = SocketClient::connect(path).value();
    ASSERT_TRUE(client.subscribe({"event"}));
    ASSERT_TRUE(client.ask("publish"));
    ASSERT_TRUE(client.ask("echo"));
    for (int i = 0; i < 3; ++i) {
        const auto next = client.next(milliseconds(2000)).value();
        ASSERT_TRUE(next);
        EXPECT_EQ(next->topic, "event");
        EXPECT_EQ(next->params["i"], i);
    }
    EXPECT_FALSE(client.next(milliseconds(0)).value());
}

TEST_F(Client, AnAnswerThatDoesNotComeIsAnErrorInTime) {
    auto client = SocketClient::connect(path).value();
    const auto late = client.ask("late", json::object(), milliseconds(50));
    ASSERT_FALSE(late);
    EXPECT_EQ(late.error().next, NextStep::reopen_link);
    EXPECT_THAT(late.error().message, HasSubstr("did not answer \"late\" within 0.05 s"));
    // The late answer is not taken for that of the next question.
    EXPECT_EQ(client.ask("echo", {{"a", 2}}).value(), json({{"a", 2}}));
}

TEST_F(Client, ADaemonThatEndsIsNoticed) {
    auto client = SocketClient::connect(path).value();
    ASSERT_TRUE(client.subscribe({"event"}));
    server.reset();
    const auto next = client.next(milliseconds(5000));
    ASSERT_FALSE(next);
    EXPECT_EQ(next.error().next, NextStep::reopen_link);
    EXPECT_FALSE(client.ask("echo"));
}

TEST_F(Client, ASocketThatNobodyServes) {
    server.reset();
    for (const std::string& gone : {path.string(), std::string("/nonexistent/x.sock")}) {
        const auto none = SocketClient::connect(gone);
        ASSERT_FALSE(none);
        EXPECT_EQ(none.error().next, NextStep::reopen_link);
        EXPECT_EQ(none.error().message,
                  "no thermbald answers on " + gone + ": start it, or name its socket with --socket");
    }
    EXPECT_EQ(SocketClient::connect(std::string(200, 'x')).error().next, NextStep::refuse_input);
}

}  // namespace
}  // namespace thermbal::test
