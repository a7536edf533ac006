#include "simulator/server.hpp"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "simulator/sim_clock.hpp"

namespace thermbal {
namespace {

constexpr short readable = POLLIN | POLLHUP | POLLERR;

bool try_again(int error) {
    return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

}  // namespace

void Server::listen(TcpEndpoint endpoint) {
    tcp_ = std::move(endpoint);
}

void Server::attach(PtyEndpoint pty) {
    pty_ = std::move(pty);
    Connection line;
    line.fd = std::move(pty_->master);
    line.framing = Framing::rtu;
    connections_.push_back(std::move(line));
}

Result<void> Server::run(int stop_fd) {
    for (;;) {
        std::vector<pollfd> polled = {{.fd = stop_fd, .events = POLLIN, .revents = 0}};
        for (const UniqueFd& listener : tcp_.listeners) polled.push_back({listener.get(), POLLIN, 0});
        for (Connection& connection : connections_) {
            connection.poll_slot = polled.size();
            const short writes = connection.unsent.empty() ? short{0} : short{POLLOUT};
            polled.push_back({connection.fd.get(), static_cast<short>(POLLIN | writes), 0});
        }
        if (poll(polled.data(), polled.size(), wait_ms(monotonic_ns())) < 0 && errno != EINTR) {
            return fail(NextStep::stop,
                        fmt::format("server: poll failed ({})", std::generic_category().message(errno)));
        }
        if (polled.front().revents != 0) return {};

        for (Connection& connection : connections_) {
            if ((polled[connection.poll_slot].revents & readable) != 0) read_from(connection, monotonic_ns());
            handle_received(connection, monotonic_ns());
            send_due(connection, monotonic_ns());
            flush(connection);
        }
        connections_.remove_if(
            [](const Connection& c) { return c.closing && c.framing == Framing::tcp && c.unsent.empty(); });
        for (std::size_t i = 0; i < tcp_.listeners.size(); ++i) {
            if (polled[1 + i].revents != 0) accept_from(tcp_.listeners[i].get());
        }
    }
}

int Server::wait_ms(std::int64_t now_ns) const {
    std::int64_t until_ns = now_ns + 1'000'000'000;
    for (const Connection& connection : connections_) {
        for (const Pending& pending : connection.pending) until_ns = std::min(until_ns, pending.due_ns);
        if (connection.framing == Framing::rtu && !connection.received.empty()) {
            until_ns = std::min(until_ns, connection.last_byte_ns + limits_.silence_ns);
        }
    }
    return static_cast<int>(std::max<std::int64_t>(0, (until_ns - now_ns + 999'999) / 1'000'000));
}

void Server::accept_from(int listener) {
    Connection connection;
    connection.fd = UniqueFd(accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!connection.fd.valid() || connections_.size() >= limits_.clients) return;
    const int on = 1;
    setsockopt(connection.fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    connections_.push_back(std::move(connection));
}

void Server::read_from(Connection& connection, std::int64_t now_ns) {
    std::uint8_t block[1024];
    const ssize_t got = read(connection.fd.get(), block, sizeof block);
    if (got > 0) {
        connection.received.insert(connection.received.end(), block, block + got);
        connection.last_byte_ns = now_ns;
        return;
    }
    if (got < 0 && try_again(errno)) return;
    drop(connection);
}

void Server::handle_received(Connection& connection, std::int64_t now_ns) {
    while (!connection.closing && !connection.received.empty()) {
        const bool silence = now_ns - connection.last_byte_ns >= limits_.silence_ns;
        const ParsedRequest parsed = connection.framing == Framing::tcp
                                         ? parse_tcp_request(connection.received)
                                         : parse_rtu_request(connection.received, silence);
        if (parsed.kind == ParsedRequest::Kind::incomplete) break;
        connection.received.erase(connection.received.begin(),
                                  connection.received.begin() + static_cast<std::ptrdiff_t>(parsed.consumed));
        if (parsed.kind == ParsedRequest::Kind::broken) connection.closing = true;
        if (parsed.kind != ParsedRequest::Kind::request) continue;
        if (connection.pending.size() >= limits_.pending_replies) continue;
        if (pty_ && connection.framing == Framing::rtu) release_exclusive(*pty_);
        for (Delivery& delivery : serve_(connection.framing, parsed.request, now_ns)) {
            const auto delay_ns = static_cast<std::int64_t>(delivery.delay_s * 1e9);
            connection.pending.push_back({.due_ns = now_ns + delay_ns, .delivery = std::move(delivery)});
        }
    }
}

void Server::send_due(Connection& connection, std::int64_t now_ns) {
    std::vector<Pending> later;
    for (Pending& pending : connection.pending) {
        if (pending.due_ns > now_ns) {
            later.push_back(std::move(pending));
            continue;
        }
        const Bytes& bytes = pending.delivery.bytes;
        connection.unsent.insert(connection.unsent.end(), bytes.begin(), bytes.end());
        connection.closing = connection.closing || pending.delivery.hang_up;
    }
    connection.pending = std::move(later);
}

void Server::flush(Connection& connection) {
    if (connection.unsent.empty()) return;
    const auto size = connection.unsent.size();
    const ssize_t sent = connection.framing == Framing::tcp
                             ? send(connection.fd.get(), connection.unsent.data(), size, MSG_NOSIGNAL)
                             : write(connection.fd.get(), connection.unsent.data(), size);
    if (sent > 0) {
        connection.unsent.erase(connection.unsent.begin(), connection.unsent.begin() + sent);
    } else if (sent < 0 && !try_again(errno)) {
        drop(connection);
    }
    if (connection.unsent.size() > limits_.unsent_bytes) drop(connection);
}

void Server::drop(Connection& connection) {
    connection.received.clear();
    connection.pending.clear();
    connection.unsent.clear();
    connection.closing = connection.framing == Framing::tcp;
}

}  // namespace thermbal
