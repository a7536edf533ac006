#include "simulator/control.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

namespace thermbal {
namespace {

constexpr std::string_view accepted =
    "accepted: fault KIND[=VALUE][:TARGET] [SECONDS], clear [KIND], list, time";
constexpr std::size_t longest_line = 4096;
constexpr std::size_t most_clients = 16;

std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    while (!line.empty()) {
        const std::size_t end = line.find_first_of(" \t\r");
        if (end != 0) words.push_back(line.substr(0, end));
        if (end == std::string_view::npos) break;
        line.remove_prefix(end + 1);
    }
    return words;
}

std::string add_fault(std::string_view what, std::string_view for_s, FaultPlan& plan, double now_s) {
    auto fault = parse_fault_kind(what);
    if (!fault) return "error " + fault.error().message;
    if (auto acts = check_reach(*fault, plan.reach()); !acts) return "error " + acts.error().message;
    fault->from_s = now_s;
    if (!for_s.empty()) {
        double seconds = 0.0;
        const auto [end, error] = std::from_chars(for_s.data(), for_s.data() + for_s.size(), seconds);
        if (error != std::errc{} || end != for_s.data() + for_s.size() || !(seconds > 0.0) ||
            !std::isfinite(seconds)) {
            return fmt::format("error '{}' is no duration in seconds", for_s);
        }
        fault->to_s = now_s + seconds;
    }
    plan.add(*fault);
    return "ok " + to_string(*fault);
}

std::string clear_kind(std::string_view name, FaultPlan& plan) {
    const FaultEntry* entry = find_fault(name);
    if (entry == nullptr) return fmt::format("error '{}' is no fault; --help lists them", name);
    return fmt::format("ok {} cleared", plan.clear(entry->kind));
}

std::string clear_all(FaultPlan& plan) {
    const std::size_t cleared = plan.faults().size();
    plan.clear();
    return fmt::format("ok {} cleared", cleared);
}

std::string list_of(const FaultPlan& plan) {
    std::string text = "ok";
    for (const Fault& fault : plan.faults()) text += " " + to_string(fault);
    return text;
}

bool watch(int epoll, int fd) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = fd;
    return epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event) == 0;
}

std::unexpected<Error> cannot(const std::string& path, std::string_view what) {
    return fail(NextStep::refuse_input,
                fmt::format("--control {}: {}; name a path that is free, of at most 107 bytes", path, what));
}

}  // namespace

std::string obey(std::string_view line, FaultPlan& plan, double now_s) {
    const std::vector<std::string_view> words = words_of(line);
    if (words.empty()) return fmt::format("error an empty line; {}", accepted);
    if (words[0] == "fault" && (words.size() == 2 || words.size() == 3)) {
        return add_fault(words[1], words.size() == 3 ? words[2] : std::string_view(), plan, now_s);
    }
    if (words[0] == "clear" && words.size() == 1) return clear_all(plan);
    if (words[0] == "clear" && words.size() == 2) return clear_kind(words[1], plan);
    if (words[0] == "list" && words.size() == 1) return list_of(plan);
    if (words[0] == "time" && words.size() == 1) return fmt::format("ok {}", now_s);
    return fmt::format("error '{}'; {}", line, accepted);
}

Result<ControlSocket> ControlSocket::open(const std::string& path, Obey obey) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path) return cannot(path, "the path is too long");
    std::memcpy(address.sun_path, path.data(), path.size());
    struct stat existing{};
    if (lstat(path.c_str(), &existing) == 0) {
        if (!S_ISSOCK(existing.st_mode)) return cannot(path, "is there and is no socket");
        unlink(path.c_str());
    }
    ControlSocket control;
    control.obey_ = std::move(obey);
    control.listener_ = UniqueFd(socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    control.ready_ = UniqueFd(epoll_create1(EPOLL_CLOEXEC));
    const int listener = control.listener_.get();
    if (bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        listen(listener, 4) != 0 || !watch(control.ready_.get(), listener)) {
        return cannot(path, std::generic_category().message(errno));
    }
    control.path_ = path;
    return control;
}

ControlSocket::~ControlSocket() {
    if (listener_.valid() && !path_.empty()) unlink(path_.c_str());
}

void ControlSocket::accept_client() {
    Client client{.fd = UniqueFd(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)),
                  .received = {}};
    if (!client.fd.valid() || clients_.size() >= most_clients) return;
    if (watch(ready_.get(), client.fd.get())) clients_.push_back(std::move(client));
}

bool ControlSocket::serve(Client& client) {
    char block[1024];
    const ssize_t got = read(client.fd.get(), block, sizeof block);
    if (got < 0) return errno == EAGAIN || errno == EINTR;
    if (got == 0) return false;
    client.received.append(block, static_cast<std::size_t>(got));
    for (std::size_t end = 0; (end = client.received.find('\n')) != std::string::npos;) {
        const std::string answer = obey_(std::string_view(client.received).substr(0, end)) + "\n";
        client.received.erase(0, end + 1);
        // An answer is short; who does not read it has no use for it.
        if (send(client.fd.get(), answer.data(), answer.size(), MSG_NOSIGNAL) < 0) return false;
    }
    return client.received.size() <= longest_line;
}

void ControlSocket::dispatch() {
    epoll_event events[1 + most_clients];
    const int count = epoll_wait(ready_.get(), events, 1 + most_clients, 0);
    for (int i = 0; i < count; ++i) {
        const int fd = events[i].data.fd;
        if (fd == listener_.get()) {
            accept_client();
            continue;
        }
        const auto client =
            std::ranges::find_if(clients_, [fd](const Client& c) { return c.fd.get() == fd; });
        if (client != clients_.end() && !serve(*client)) clients_.erase(client);
    }
}

}  // namespace thermbal
