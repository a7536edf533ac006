#pragma once

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "service/socket_server.hpp"

namespace thermbal::test {

using nlohmann::json;

class Folder {
  public:
    Folder() {
        std::string name = (std::filesystem::temp_directory_path() / "thermbal-service-XXXXXX").string();
        path_ = mkdtemp(name.data());
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    std::filesystem::path operator/(const char* name) const { return path_ / name; }
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

/// A client that knows nothing but bytes and lines.
class LineClient {
  public:
    explicit LineClient(const std::filesystem::path& path)
        : fd_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
        if (connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
            throw std::runtime_error(std::string("connect: ") + std::strerror(errno));
    }
    LineClient(LineClient&& other) noexcept
        : fd_(std::exchange(other.fd_, -1)), rest_(std::move(other.rest_)) {}
    LineClient& operator=(LineClient&&) = delete;
    ~LineClient() {
        if (fd_ >= 0) close(fd_);
    }

    bool send(std::string_view bytes) const {
        while (!bytes.empty()) {
            const auto count = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
            if (count <= 0) return false;
            bytes.remove_prefix(static_cast<std::size_t>(count));
        }
        return true;
    }
    void close_sending_side() const { shutdown(fd_, SHUT_WR); }

    /// The next line; empty at the end of the stream, or when nothing comes for five seconds.
    std::optional<std::string> line() {
        for (;;) {
            if (const auto end = rest_.find('\n'); end != std::string::npos) {
                auto text = rest_.substr(0, end);
                rest_.erase(0, end + 1);
                return text;
            }
            pollfd waiting{fd_, POLLIN, 0};
            if (poll(&waiting, 1, 5000) <= 0) return std::nullopt;
            std::array<char, 65536> buffer;
            const auto count = recv(fd_, buffer.data(), buffer.size(), 0);
            if (count <= 0) return std::nullopt;
            rest_.append(buffer.data(), static_cast<std::size_t>(count));
        }
    }
    json ask(std::string_view request) {
        send(std::string(request) + "\n");
        const auto reply = line();
        return reply ? json::parse(*reply) : json("no reply");
    }
    bool closed_by_server() {
        while (line()) {
        }
        pollfd waiting{fd_, POLLIN, 0};
        return poll(&waiting, 1, 0) > 0;
    }

  private:
    int fd_;
    std::string rest_;
};

/// A server on a thread of its own, with a few methods. Everything else is asked through the socket.
class RunningServer {
  public:
    explicit RunningServer(const SocketServerOptions& options) : server_(opened(options)) {
        server_.add_topics({"event", "scan"});
        server_.add_method("echo", Access::reads, [](const Request& request) { return request.params; });
        server_.add_method("whoami", Access::reads, [](const Request& request) {
            return json{{"uid", request.peer.uid}, {"pid", request.peer.pid}};
        });
        server_.add_method("stop_test", Access::changes, [this](const Request&) {
            ++stops;
            return json{{"stopped", true}};
        });
        server_.add_method("number", Access::reads,
                           [](const Request& request) { return json(request.params.at("n").get<int>()); });
        server_.add_method("fails", Access::reads, [](const Request&) -> Result<json> {
            return fail(NextStep::retry, "the database is locked; try again");
        });
        server_.add_method("large", Access::reads, [](const Request& request) {
            return json(std::string(request.params.at("bytes").get<std::size_t>(), 'x'));
        });
        server_.add_method("publish", Access::reads, [this](const Request& request) {
            server_.publish(request.params.at("topic").get<std::string>(), request.params.at("params"));
            return json(true);
        });
        server_.add_method("counters", Access::reads, [this](const Request&) {
            const auto c = server_.counters();
            return json{{"clients", c.clients},
                        {"subscribers", c.subscribers},
                        {"dropped", c.dropped},
                        {"refused", c.refused},
                        {"denied", c.denied}};
        });
        thread_ = std::thread([this] {
            while (!done_) {
                pollfd waiting{server_.fd(), POLLIN, 0};
                if (poll(&waiting, 1, 20) > 0) {
                    server_.dispatch();
                    ++dispatches;
                }
            }
        });
    }
    ~RunningServer() {
        done_ = true;
        thread_.join();
    }

    std::atomic<int> stops = 0;
    std::atomic<std::uint64_t> dispatches = 0;

  private:
    static SocketServer opened(const SocketServerOptions& options) {
        auto server = SocketServer::open(options);
        if (!server) throw std::runtime_error(server.error().message);
        return std::move(*server);
    }
    SocketServer server_;
    std::atomic<bool> done_ = false;
    std::thread thread_;
};

}  // namespace thermbal::test
