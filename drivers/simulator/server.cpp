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

#include "simulator/sim_clock.hpp"

namespace thermbal {
namespace {

constexpr short readable = POLLIN | POLLHUP | POLLERR;

}  // namespace

void Server::listen(TcpEndpoint endpoint) {
    tcp_ = std::move(endpoint);
    port_ = tcp_.port;
}

Result<void> Server::attach(std::function<Result<PtyLine>()> plug_in_line) {
    open_port_ = std::move(plug_in_line);
    return plug_in();
}

Result<void> Server::plug_in() {
    auto line = open_port_();
    if (!line) return std::unexpected(line.error());
    pty_ = std::make_unique<PtyLine>(std::move(*line));
    old_port_.reset();
    connections_.emplace_back(std::move(pty_->port.master), Framing::rtu);
    return {};
}

void Server::watch_endpoint(EndpointStateAt state, int look_again_ms) {
    state_at_ = std::move(state);
    look_again_ms_ = look_again_ms;
}

void Server::watch(int fd, std::function<void()> on_readable) {
    watched_.push_back({fd, std::move(on_readable)});
}

bool Server::busy() const {
    return std::ranges::any_of(connections_, [](const Connection& c) { return c.busy(); });
}

Result<void> Server::run(int stop_fd) {
    for (;;) {
        if (auto applied = apply(state_at_(monotonic_ns())); !applied) return applied;
        std::vector<pollfd> polled = {{.fd = stop_fd, .events = POLLIN, .revents = 0}};
        for (const Watched& watched : watched_) polled.push_back({watched.fd, POLLIN, 0});
        // A half-open endpoint does not look at what arrives; the kernel goes on accepting connections.
        const auto looks = static_cast<short>(state_.half_open ? 0 : POLLIN);
        for (const UniqueFd& listener : tcp_.listeners) polled.push_back({listener.get(), looks, 0});
        const std::size_t first_connection = polled.size();
        for (const Connection& connection : connections_) {
            const short writes = connection.wants_to_write() ? short{POLLOUT} : short{0};
            polled.push_back(
                {state_.half_open ? -1 : connection.fd(), static_cast<short>(looks | writes), 0});
        }
        if (poll(polled.data(), polled.size(), wait_ms(monotonic_ns())) < 0 && errno != EINTR) {
            return fail(NextStep::stop,
                        fmt::format("server: poll failed ({})", std::generic_category().message(errno)));
        }
        if (polled.front().revents != 0) return {};

        std::vector<short> readiness;
        for (std::size_t i = first_connection; i < polled.size(); ++i) readiness.push_back(polled[i].revents);
        if (!state_.half_open) serve_connections(readiness);
        for (std::size_t i = 0; i < tcp_.listeners.size(); ++i) {
            const pollfd& listener = polled[1 + watched_.size() + i];
            if ((listener.revents & POLLIN) != 0) accept_from(listener.fd, monotonic_ns());
        }
        for (std::size_t i = 0; i < watched_.size(); ++i) {
            if (polled[1 + i].revents != 0) watched_[i].on_readable();
        }
    }
}

void Server::serve_connections(const std::vector<short>& readiness) {
    std::size_t i = 0;
    for (Connection& connection : connections_) {
        if ((readiness[i++] & readable) != 0) connection.read(monotonic_ns());
        connection.serve(
            [this](Framing framing, const ModbusRequest& request, std::int64_t now_ns) {
                if (pty_) release_exclusive(pty_->port);
                return serve_(framing, request, now_ns);
            },
            limits_, monotonic_ns());
    }
    const auto ended = connections_.remove_if([](const Connection& c) { return c.ended(); });
    if (ended > 0 && state_.one_client_hold_s) {
        place_free_ns_ = monotonic_ns() + static_cast<std::int64_t>(*state_.one_client_hold_s * 1e9);
    }
}

int Server::wait_ms(std::int64_t now_ns) const {
    std::int64_t until_ns = now_ns + std::int64_t{look_again_ms_} * 1'000'000;
    if (!state_.half_open) {
        for (const Connection& connection : connections_) {
            until_ns = connection.next_due_ns(limits_, until_ns);
        }
    }
    return static_cast<int>(std::max<std::int64_t>(0, (until_ns - now_ns + 999'999) / 1'000'000));
}

bool Server::has_a_place(std::int64_t now_ns) const {
    if (connections_.size() >= limits_.clients) return false;
    return !state_.one_client_hold_s || (connections_.empty() && now_ns >= place_free_ns_);
}

void Server::accept_from(int listener, std::int64_t now_ns) {
    UniqueFd fd(accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!fd.valid() || !has_a_place(now_ns)) return;
    const int on = 1;
    setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    connections_.emplace_back(std::move(fd), Framing::tcp);
}

Result<void> Server::apply(const EndpointState& state) {
    if (state == state_) return {};
    const Result<void> done = port_ != 0 ? apply_to_listeners(state) : apply_to_port(state);
    state_ = state;
    return done;
}

Result<void> Server::apply_to_listeners(const EndpointState& state) {
    if (state.refuses == state_.refuses) return {};
    if (state.refuses) {
        tcp_ = {};
        connections_.clear();
        return {};
    }
    auto again = listen_on_loopback(port_);
    if (!again) return std::unexpected(again.error());
    tcp_ = std::move(*again);
    return {};
}

Result<void> Server::apply_to_port(const EndpointState& state) {
    if (state.unplugged == state_.unplugged) return {};
    if (!state.unplugged) return plug_in();
    connections_.clear();
    old_port_ = std::move(pty_->port.slave);
    pty_.reset();
    return {};
}

}  // namespace thermbal
