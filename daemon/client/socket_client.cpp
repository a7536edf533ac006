#include "socket_client.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace thermbal {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

/// The daemon's replies end at 8 MiB; a longer line comes from something else.
constexpr std::size_t most_line_bytes = std::size_t{16} << 20;
constexpr std::size_t most_kept = 10'000;

int poll_limit_ms(steady_clock::time_point deadline) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - steady_clock::now()).count();
    return static_cast<int>(std::clamp<milliseconds::rep>(left, 0, 3'600'000));
}

/// Whether `fd` is ready for `events` before the deadline. A signal ends the wait as the deadline does.
bool wait_for(int fd, short events, steady_clock::time_point deadline) {
    pollfd waiting{fd, events, 0};
    return poll(&waiting, 1, poll_limit_ms(deadline)) > 0;
}

std::string advice(int reason, const std::string& path) {
    if (reason == EACCES || reason == EPERM) {
        return fmt::format("no permission for the socket {}: run as root or as a user who may open it", path);
    }
    if (reason == ENOENT || reason == ECONNREFUSED) {
        return fmt::format("no thermbald answers on {}: start it, or name its socket with --socket", path);
    }
    return fmt::format("{}: {}", path, strerrordesc_np(reason));
}

std::string member(const json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

Error refusal(const json& error) {
    constexpr int invalid_params = -32602;
    constexpr int not_now = -32003;
    const auto code = error.find("code");
    const int number = code != error.end() && code->is_number_integer() ? code->get<int>() : 0;
    std::string message = member(error, "message");
    if (message.empty()) message = "the daemon refused without a reason";
    return {number == invalid_params ? NextStep::refuse_input
            : number == not_now      ? NextStep::retry
                                     : NextStep::stop,
            std::move(message)};
}

}  // namespace

Result<SocketClient> SocketClient::connect(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.empty() || path.size() >= sizeof address.sun_path) {
        return fail(NextStep::refuse_input, fmt::format("--socket {}: expected a path of 1 to {} bytes", path,
                                                        sizeof address.sun_path - 1));
    }
    path.copy(address.sun_path, path.size());
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0) return fail(NextStep::stop, fmt::format("socket: {}", strerrordesc_np(errno)));
    SocketClient client(fd, path);
    // A Unix socket connects at once, or its queue is full (EAGAIN): then nobody is serving it.
    if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        return fail(NextStep::reopen_link, advice(errno == EAGAIN ? ECONNREFUSED : errno, path));
    }
    return client;
}

SocketClient::SocketClient(SocketClient&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      path_(std::move(other.path_)),
      unread_(std::move(other.unread_)),
      searched_(other.searched_),
      kept_(std::move(other.kept_)),
      last_id_(other.last_id_) {}

SocketClient& SocketClient::operator=(SocketClient&& other) noexcept {
    std::swap(fd_, other.fd_);
    std::swap(path_, other.path_);
    std::swap(unread_, other.unread_);
    std::swap(searched_, other.searched_);
    std::swap(kept_, other.kept_);
    std::swap(last_id_, other.last_id_);
    return *this;
}

SocketClient::~SocketClient() {
    if (fd_ >= 0) close(fd_);
}

std::unexpected<Error> SocketClient::broken(std::string_view why) const {
    return fail(NextStep::reopen_link, fmt::format("{}: {}", path_, why));
}

Result<void> SocketClient::send_line(std::string line, Deadline deadline) const {
    line += '\n';
    std::string_view rest = line;
    while (!rest.empty()) {
        const ssize_t sent = send(fd_, rest.data(), rest.size(), MSG_NOSIGNAL);
        if (sent >= 0) {
            rest.remove_prefix(static_cast<std::size_t>(sent));
        } else if (errno == EAGAIN) {
            if (!wait_for(fd_, POLLOUT, deadline)) return broken("thermbald takes no requests at the moment");
        } else if (errno != EINTR) {
            return broken("thermbald closed the connection");
        }
    }
    return {};
}

Result<std::optional<std::string>> SocketClient::read_line(Deadline deadline) {
    std::array<char, 65536> buffer;
    for (;;) {
        if (const std::size_t end = unread_.find('\n', searched_); end != std::string::npos) {
            std::string line = unread_.substr(0, end);
            unread_.erase(0, end + 1);
            searched_ = 0;
            return line;
        }
        searched_ = unread_.size();
        if (unread_.size() > most_line_bytes) return broken("a line without end: this is no thermbald");
        const ssize_t got = recv(fd_, buffer.data(), buffer.size(), 0);
        if (got > 0) {
            unread_.append(buffer.data(), static_cast<std::size_t>(got));
        } else if (got == 0) {
            return broken("thermbald closed the connection");
        } else if (errno == EAGAIN || errno == EINTR) {
            if (!wait_for(fd_, POLLIN, deadline)) return std::nullopt;
        } else {
            return broken(strerrordesc_np(errno));
        }
    }
}

Result<json> SocketClient::parsed(const std::string& line) const {
    json document = json::parse(line, nullptr, false);
    if (!document.is_object() || member(document, "jsonrpc") != "2.0") {
        return broken("the answer is no JSON-RPC: this is no thermbald");
    }
    return document;
}

Result<json> SocketClient::ask(const std::string& method, const json& params, milliseconds limit) {
    const Deadline deadline = steady_clock::now() + limit;
    const int id = ++last_id_;
    const json request = {{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", params}};
    // A text from the command line may be in another encoding than UTF-8.
    auto sent = send_line(request.dump(-1, ' ', false, json::error_handler_t::replace), deadline);
    if (!sent) return std::unexpected(sent.error());
    for (;;) {
        const auto line = read_line(deadline);
        if (!line) return std::unexpected(line.error());
        if (!*line) {
            return broken(fmt::format("thermbald did not answer \"{}\" within {} s", method,
                                      std::chrono::duration<double>(limit).count()));
        }
        auto document = parsed(**line);
        if (!document) return document;
        if (document->contains("method")) {
            if (kept_.size() == most_kept) kept_.pop_front();
            kept_.push_back({member(*document, "method"), document->value("params", json::object())});
            continue;
        }
        if (document->value("id", json()) != json(id)) continue;
        if (const auto error = document->find("error"); error != document->end()) {
            return std::unexpected(refusal(*error));
        }
        return document->value("result", json());
    }
}

Result<void> SocketClient::subscribe(const std::vector<std::string>& topics) {
    const auto answer = ask("subscribe", {{"topics", topics}});
    if (!answer) return std::unexpected(answer.error());
    return {};
}

Result<std::optional<Notification>> SocketClient::next(milliseconds limit) {
    const Deadline deadline = steady_clock::now() + limit;
    while (kept_.empty()) {
        const auto line = read_line(deadline);
        if (!line) return std::unexpected(line.error());
        if (!*line) return std::nullopt;
        const auto document = parsed(**line);
        if (!document) return std::unexpected(document.error());
        if (document->contains("method")) {
            return Notification{member(*document, "method"), document->value("params", json::object())};
        }
    }
    Notification oldest = std::move(kept_.front());
    kept_.pop_front();
    return oldest;
}

}  // namespace thermbal
