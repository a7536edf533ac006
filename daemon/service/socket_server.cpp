#include "service/socket_server.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "base/errno_text.hpp"
#include "descriptor.hpp"
#include "json_rpc.hpp"
#include "listener.hpp"
#include "permissions.hpp"

namespace thermbal {

using nlohmann::json;

namespace {

// With more than this unread, a client's further requests wait until it has read.
constexpr std::size_t enough_unread = 256UL * 1024;
constexpr std::size_t most_topics = 32;
/// The step in which what clients may ask is refilled.
constexpr long refill_ns = 50'000'000;

struct Client {
    Descriptor socket;
    Peer peer;
    std::vector<gid_t> groups;

    std::string received;
    std::string unsent;
    std::size_t sent = 0;              ///< of `unsent`
    std::size_t requests_left = 0;     ///< until the next refill
    std::size_t published_unread = 0;  ///< notifications queued since `unsent` was last empty
    bool subscribed = false;
    std::set<std::string, std::less<>> topics;  ///< empty: all

    bool ended = false;       ///< the client sends no more
    bool last_words = false;  ///< to be closed when `unsent` is out
    bool dead = false;
    std::uint32_t watched = 0;

    std::size_t unread() const { return unsent.size() - sent; }
    bool takes_requests() const {
        return !dead && !last_words && requests_left > 0 && unread() < enough_unread;
    }
    bool follows(std::string_view topic) const {
        return subscribed && !dead && !last_words && (topics.empty() || topics.contains(topic));
    }
};

Peer peer_of(int socket) {
    ucred credentials{};
    socklen_t length = sizeof credentials;
    // Without credentials the peer is nobody in particular, and may only read.
    if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &length) != 0)
        return {0, static_cast<uid_t>(-1), static_cast<gid_t>(-1)};
    return {credentials.pid, credentials.uid, credentials.gid};
}

int code_of(NextStep next) {
    switch (next) {
        case NextStep::refuse_input:
            return json_rpc::invalid_params;
        case NextStep::retry:
            return json_rpc::try_again;
        default:
            return json_rpc::failed;
    }
}

/// An empty set means all topics.
Result<std::set<std::string, std::less<>>> topics_in(const json& params,
                                                     const std::set<std::string, std::less<>>& known) {
    std::set<std::string, std::less<>> topics;
    const auto list = params.find("topics");
    if (list == params.end()) return topics;
    const bool strings = list->is_array() &&
                         std::all_of(list->begin(), list->end(), [](const json& t) { return t.is_string(); });
    if (!strings || list->empty() || list->size() > most_topics)
        return fail(NextStep::refuse_input,
                    fmt::format("subscribe: topics must be a list of 1 to {} names", most_topics));
    for (const auto& topic : *list) topics.insert(topic.get<std::string>());
    const auto unknown =
        std::ranges::find_if(topics, [&](const auto& topic) { return !known.contains(topic); });
    if (unknown != topics.end()) {
        return fail(NextStep::refuse_input,
                    fmt::format("subscribe: no such topic; there are: {}", fmt::join(known, ", ")));
    }
    return topics;
}

}  // namespace

struct SocketServer::Parts {
    struct Method {
        Access access;
        Handler handler;
    };

    SocketServerOptions options;
    Operators operators;
    Listener listener;
    Descriptor epoll;
    Descriptor refill_timer;
    Descriptor spare;  ///< given up to accept and refuse when the process has no descriptor left
    std::map<std::string, Method, std::less<>> methods;
    std::set<std::string, std::less<>> topics;
    std::map<int, Client> clients;
    Counters counters;
    bool dispatching = false;
    bool refilling = false;         ///< the timer runs: somebody has asked since the last refill
    bool connections_wait = false;  ///< no descriptor left, not even to refuse: tried again at each dispatch

    void accept_clients();
    bool refuse_without_descriptor();
    void run_refill_timer(bool run);
    void refill();
    bool has_room_for(const Peer& peer) const;
    void refuse_client(const Descriptor& socket);
    void serve(Client& client, std::uint32_t events);
    void receive(Client& client);
    void answer_lines(Client& client);
    void answer_received(Client& client);
    void refuse_line(Client& client);
    void answer(Client& client, std::string_view line);
    std::string reply_to(Client& client, json_rpc::Call& call);
    Result<json> result_of(Client& client, json_rpc::Call& call, const Method& method) const;
    Result<json> subscribe(Client& client, const json& params) const;
    std::size_t unread_of_all() const;
    void send(Client& client);
    void drop(Client& client);
    void watch(Client& client);
    void bury();
};

void SocketServer::Parts::accept_clients() {
    for (;;) {
        Descriptor socket(accept4(listener.fd(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
        if (!socket.valid()) {
            const int error = errno;
            if (error == EINTR || error == ECONNABORTED) continue;
            if ((error == EMFILE || error == ENFILE) && refuse_without_descriptor()) continue;
            connections_wait = error != EAGAIN;
            return;
        }
        const Peer peer = peer_of(socket.get());
        if (!has_room_for(peer)) {
            refuse_client(socket);
            continue;
        }
        ++counters.accepted;
        const int fd = socket.get();
        Client client;
        client.peer = peer;
        client.groups = peer_groups(fd);
        client.socket = std::move(socket);
        client.requests_left = options.max_requests_per_50_ms;
        epoll_event event{};
        event.data.fd = fd;
        epoll_ctl(epoll.get(), EPOLL_CTL_ADD, fd, &event);
        watch(clients.insert_or_assign(fd, std::move(client)).first->second);
    }
}

bool SocketServer::Parts::refuse_without_descriptor() {
    spare.reset();
    bool refused = false;
    {
        const Descriptor socket(accept4(listener.fd(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
        refused = socket.valid();
        if (refused) refuse_client(socket);
    }
    // Another thread may have taken the place that was given up.
    spare = Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    return refused && spare.valid();
}

bool SocketServer::Parts::has_room_for(const Peer& peer) const {
    const bool own = peer.uid == 0 || peer.uid == geteuid();
    if (clients.size() >= options.max_clients) return false;
    const auto of_user = std::count_if(clients.begin(), clients.end(),
                                       [&](const auto& entry) { return entry.second.peer.uid == peer.uid; });
    return own || static_cast<std::size_t>(of_user) < options.max_clients_per_user;
}

void SocketServer::Parts::refuse_client(const Descriptor& socket) {
    ++counters.refused;
    const auto line =
        json_rpc::error_reply({json_rpc::try_again, "too many clients; close one, or try again", nullptr});
    (void)::send(socket.get(), line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

void SocketServer::Parts::run_refill_timer(bool run) {
    if (refilling == run) return;
    const timespec step{0, run ? refill_ns : 0};
    const itimerspec when{step, step};
    timerfd_settime(refill_timer.get(), 0, &when, nullptr);
    refilling = run;
}

/// Everybody may ask again; who had to wait is served. A step in which nobody asked ends the steps.
void SocketServer::Parts::refill() {
    std::uint64_t expirations = 0;
    if (read(refill_timer.get(), &expirations, sizeof expirations) < 0) return;
    bool asked = false;
    for (auto& [fd, client] : clients) {
        if (client.requests_left == options.max_requests_per_50_ms) continue;
        asked = true;
        client.requests_left = options.max_requests_per_50_ms;
        if (!client.dead) serve(client, 0);
    }
    run_refill_timer(asked);
}

void SocketServer::Parts::serve(Client& client, std::uint32_t events) {
    if ((events & (EPOLLIN | EPOLLHUP | EPOLLERR)) != 0 && !client.ended && client.takes_requests())
        receive(client);
    if (client.unread() > 0) send(client);
    // What waited until the client had read its replies.
    answer_lines(client);
    // A subscriber that has closed its sending side still listens.
    if (client.ended && client.received.empty() && !client.subscribed) client.last_words = true;
    if (client.last_words && client.unread() == 0) client.dead = true;
    const bool gone = (events & EPOLLERR) != 0 || ((events & EPOLLHUP) != 0 && client.ended);
    if (gone) client.dead = true;
    watch(client);
}

void SocketServer::Parts::receive(Client& client) {
    std::array<char, std::size_t{16} * 1024> buffer;
    const auto count = recv(client.socket.get(), buffer.data(), buffer.size(), 0);
    if (count > 0) {
        client.received.append(buffer.data(), static_cast<std::size_t>(count));
        return;
    }
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    client.ended = true;
    if (count < 0) client.dead = true;
    // A last line without its newline counts: a JSON object that was cut off cannot parse as one.
    if (!client.received.empty() && client.received.back() != '\n') client.received += '\n';
}

void SocketServer::Parts::answer_lines(Client& client) {
    // Sending makes room for the lines that had to wait: nothing else would come back for them.
    do {
        answer_received(client);
        send(client);
    } while (client.takes_requests() && client.received.find('\n') != std::string::npos);
}

void SocketServer::Parts::answer_received(Client& client) {
    std::size_t done = 0;
    while (client.takes_requests()) {
        const auto end = std::min(client.received.find('\n', done), client.received.size());
        if (end - done > options.max_request_bytes) {
            refuse_line(client);
            return;
        }
        if (end == client.received.size()) break;
        answer(client, std::string_view(client.received).substr(done, end - done));
        done = end + 1;
    }
    client.received.erase(0, done);
}

void SocketServer::Parts::refuse_line(Client& client) {
    ++counters.dropped;
    client.unsent += json_rpc::error_reply(
        {json_rpc::invalid_request,
         fmt::format("a request is one line of at most {} bytes", options.max_request_bytes), nullptr});
    client.received.clear();
    client.last_words = true;
}

void SocketServer::Parts::answer(Client& client, std::string_view line) {
    --client.requests_left;
    run_refill_timer(true);
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) return;
    ++counters.requests;
    auto call = json_rpc::parse(line);
    if (!call) {
        client.unsent += json_rpc::error_reply(call.error());
        return;
    }
    std::string reply = reply_to(client, *call);
    if (!call->notification) client.unsent += reply;
}

std::string SocketServer::Parts::reply_to(Client& client, json_rpc::Call& call) {
    const auto failure = [&](int code, std::string message) {
        return json_rpc::error_reply({code, std::move(message), call.id});
    };
    const auto method = methods.find(call.method);
    if (method == methods.end()) {
        std::string known;
        for (const auto& [name, entry] : methods) known += (known.empty() ? "" : ", ") + name;
        return failure(json_rpc::unknown_method, fmt::format("no such method; there are: {}", known));
    }
    if (method->second.access == Access::changes && !operators.may_change(client.peer, client.groups)) {
        ++counters.denied;
        return failure(json_rpc::permission_denied, operators.denial(client.peer, call.method));
    }
    auto result = result_of(client, call, method->second);
    if (!result) return failure(code_of(result.error().next), result.error().message);
    auto reply = json_rpc::reply(call.id, std::move(*result));
    if (reply.size() > options.max_reply_bytes)
        return failure(json_rpc::reply_too_large,
                       fmt::format("the reply has {} bytes, {} are the most; ask for less at once",
                                   reply.size(), options.max_reply_bytes));
    if (unread_of_all() + reply.size() > options.max_pending_bytes)
        return failure(json_rpc::try_again, "too many replies wait to be read by clients; try again");
    return reply;
}

Result<json> SocketServer::Parts::result_of(Client& client, json_rpc::Call& call,
                                            const Method& method) const {
    // The handlers' own mistakes with what the outside sent (a number that is a string) must not end the
    // daemon.
    try {
        if (call.method == "subscribe") return subscribe(client, call.params);
        if (call.method == "unsubscribe") {
            client.subscribed = false;
            return json::object();
        }
        return method.handler({call.method, std::move(call.params), client.peer});
    } catch (const json::exception& mistake) {
        return fail(NextStep::refuse_input, fmt::format("{}: {}", call.method, mistake.what()));
    } catch (const std::exception& mistake) {
        return fail(NextStep::stop, fmt::format("{}: {}", call.method, mistake.what()));
    }
}

Result<json> SocketServer::Parts::subscribe(Client& client, const json& params) const {
    auto chosen = topics_in(params, topics);
    if (!chosen) return std::unexpected(chosen.error());
    client.subscribed = true;
    client.topics = std::move(*chosen);
    if (client.topics.empty()) return json{{"subscribed", "all"}};
    return json{{"subscribed", client.topics}};
}

std::size_t SocketServer::Parts::unread_of_all() const {
    std::size_t sum = 0;
    for (const auto& [fd, client] : clients) sum += client.unread();
    return sum;
}

void SocketServer::Parts::send(Client& client) {
    while (client.unread() > 0 && !client.dead) {
        const auto count =
            ::send(client.socket.get(), client.unsent.data() + client.sent, client.unread(), MSG_NOSIGNAL);
        if (count >= 0) {
            client.sent += static_cast<std::size_t>(count);
        } else if (errno == EAGAIN) {
            return;
        } else if (errno != EINTR) {
            client.dead = true;
        }
    }
    client.unsent = {};
    client.sent = 0;
    client.published_unread = 0;
}

void SocketServer::Parts::drop(Client& client) {
    ++counters.dropped;
    client.dead = true;
}

void SocketServer::Parts::watch(Client& client) {
    std::uint32_t wanted = 0;
    if (!client.dead) {
        if (client.takes_requests() && !client.ended) wanted |= EPOLLIN;
        if (client.unread() > 0) wanted |= EPOLLOUT;
    }
    if (wanted == client.watched) return;
    client.watched = wanted;
    epoll_event event{};
    event.events = wanted;
    event.data.fd = client.socket.get();
    epoll_ctl(epoll.get(), EPOLL_CTL_MOD, client.socket.get(), &event);
}

void SocketServer::Parts::bury() {
    std::erase_if(clients, [](const auto& entry) { return entry.second.dead; });
}

SocketServer::SocketServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
SocketServer::SocketServer(SocketServer&&) noexcept = default;
SocketServer& SocketServer::operator=(SocketServer&&) noexcept = default;
SocketServer::~SocketServer() = default;

Result<SocketServer> SocketServer::open(const SocketServerOptions& options) {
    auto listener = Listener::open(options.path, options.mode);
    if (!listener) return std::unexpected(listener.error());
    Descriptor epoll(epoll_create1(EPOLL_CLOEXEC));
    epoll_event event{};
    // Edge-triggered: a connection that no descriptor is left for must not keep the loop spinning.
    event.events = EPOLLIN | EPOLLET;
    event.data.fd = listener->fd();
    if (!epoll.valid() || epoll_ctl(epoll.get(), EPOLL_CTL_ADD, listener->fd(), &event) != 0)
        return fail(NextStep::stop, fmt::format("socket {}: {}", options.path.string(), errno_text(errno)));
    Descriptor timer(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
    event.events = EPOLLIN;
    event.data.fd = timer.get();
    if (!timer.valid() || epoll_ctl(epoll.get(), EPOLL_CTL_ADD, timer.get(), &event) != 0)
        return fail(NextStep::stop, fmt::format("socket {}: {}", options.path.string(), errno_text(errno)));
    Descriptor spare(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    SocketServer server(std::unique_ptr<Parts>(new Parts{options,
                                                         Operators(options.operators_group),
                                                         std::move(*listener),
                                                         std::move(epoll),
                                                         std::move(timer),
                                                         std::move(spare),
                                                         {},
                                                         {},
                                                         {},
                                                         {},
                                                         false,
                                                         false,
                                                         false}));
    // Named here so that they are known methods; they act on the client itself, in result_of.
    server.add_method("subscribe", Access::reads, {});
    server.add_method("unsubscribe", Access::reads, {});
    return server;
}

void SocketServer::add_method(std::string name, Access access, Handler handler) {
    parts_->methods.insert_or_assign(std::move(name), Parts::Method{access, std::move(handler)});
}

void SocketServer::add_topics(std::set<std::string, std::less<>> topics) {
    parts_->topics.merge(topics);
}

int SocketServer::fd() const {
    return parts_->epoll.get();
}

void SocketServer::dispatch() {
    auto& parts = *parts_;
    std::array<epoll_event, 64> events;
    const int count = epoll_wait(parts.epoll.get(), events.data(), static_cast<int>(events.size()), 0);
    parts.dispatching = true;
    for (int i = 0; i < count; ++i) {
        const auto& event = events[static_cast<std::size_t>(i)];
        if (event.data.fd == parts.listener.fd()) {
            parts.accept_clients();
        } else if (event.data.fd == parts.refill_timer.get()) {
            parts.refill();
        } else if (const auto client = parts.clients.find(event.data.fd);
                   client != parts.clients.end() && !client->second.dead) {
            parts.serve(client->second, event.events);
        }
    }
    parts.dispatching = false;
    parts.bury();
    if (parts.connections_wait) parts.accept_clients();
}

void SocketServer::publish(std::string_view topic, const json& params) {
    auto& parts = *parts_;
    std::string line;
    for (auto& [fd, client] : parts.clients) {
        if (!client.follows(topic)) continue;
        if (line.empty()) line = json_rpc::notification(topic, params);
        if (client.published_unread > parts.options.max_backlog_bytes) {
            parts.drop(client);
            continue;
        }
        client.unsent += line;
        client.published_unread += line.size();
        parts.send(client);
        parts.watch(client);
    }
    // Inside a dispatch somebody up the stack may hold a client that has just died.
    if (!parts.dispatching) parts.bury();
}

SocketServer::Counters SocketServer::counters() const {
    Counters counters = parts_->counters;
    counters.clients = parts_->clients.size();
    counters.subscribers = static_cast<std::uint64_t>(
        std::count_if(parts_->clients.begin(), parts_->clients.end(),
                      [](const auto& entry) { return entry.second.subscribed && !entry.second.dead; }));
    return counters;
}

}  // namespace thermbal
