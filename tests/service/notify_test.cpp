#include "service/notify.hpp"

#include <gmock/gmock.h>

#include "support.hpp"

namespace thermbal::test {
namespace {

/// Stands in for systemd: a datagram socket named by NOTIFY_SOCKET.
class NotifyTest : public ::testing::Test {
  protected:
    NotifyTest() : fd_(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
        const auto path = folder / "notify";
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
        EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
        setenv("NOTIFY_SOCKET", path.c_str(), 1);
    }
    ~NotifyTest() override {
        unsetenv("NOTIFY_SOCKET");
        close(fd_);
    }
    std::string heard() const {
        std::array<char, 4096> buffer{};
        const auto count = recv(fd_, buffer.data(), buffer.size(), 0);
        return {buffer.data(), count > 0 ? static_cast<std::size_t>(count) : 0};
    }
    Folder folder;

  private:
    int fd_;
};

TEST_F(NotifyTest, TellsSystemd) {
    notify_ready("listening");
    EXPECT_EQ(heard(), "READY=1\nSTATUS=listening");
    notify_status("test 7\nWATCHDOG=trigger");
    EXPECT_EQ(heard(), "STATUS=test 7 WATCHDOG=trigger") << "a status is one line";
    notify_watchdog();
    EXPECT_EQ(heard(), "WATCHDOG=1");
    notify_stopping("by request");
    EXPECT_EQ(heard(), "STOPPING=1\nSTATUS=by request");
}

TEST_F(NotifyTest, TheWatchdogIsFedTwiceAsOftenAsItAsks) {
    setenv("WATCHDOG_USEC", "60000000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
    EXPECT_EQ(watchdog_interval(), std::chrono::seconds(30));
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
    EXPECT_EQ(watchdog_interval(), std::nullopt);
}

TEST(WithoutSystemd, NothingHappens) {
    unsetenv("NOTIFY_SOCKET");
    notify_ready("listening");
    notify_watchdog();
}

}  // namespace
}  // namespace thermbal::test
