#include "endpoint.hpp"

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <unistd.h>

namespace thermbal {
namespace {

std::string error_text(int error) {
    return std::generic_category().message(error);
}

struct LookupResult {
    int error = 0;
    std::vector<Address> addresses;
};

LookupResult look_up(const std::string& host, int port, int flags) {
    addrinfo hints{};
    hints.ai_family = AF_UNSPEC;
    hints.ai_socktype = SOCK_STREAM;
    hints.ai_flags = flags | AI_NUMERICSERV;
    addrinfo* list = nullptr;
    LookupResult result;
    result.error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &list);
    if (result.error != 0) return result;
    for (const addrinfo* entry = list; entry != nullptr; entry = entry->ai_next) {
        Address address;
        address.family = entry->ai_family;
        address.length = entry->ai_addrlen;
        std::memcpy(&address.storage, entry->ai_addr, entry->ai_addrlen);
        result.addresses.push_back(address);
    }
    freeaddrinfo(list);
    return result;
}

/// Waits for the end of a connect that is under way; 0 or an errno.
int finish_connect(int fd, Deadline deadline) {
    pollfd waiting{.fd = fd, .events = POLLOUT, .revents = 0};
    for (;;) {
        const int ready = poll(&waiting, 1, milliseconds_until(deadline));
        if (ready == 0) return ETIMEDOUT;
        if (ready > 0) break;
        if (errno != EINTR) return errno;
    }
    int error = 0;
    socklen_t length = sizeof error;
    if (getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &length) != 0) return errno;
    return error;
}

void make_ready_for_modbus(int fd) {
    const int on = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
    fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) & ~O_NONBLOCK);
}

/// A connected socket, or the negative of an errno.
int connect_address(const Address& address, Deadline deadline) {
    const int fd = socket(address.family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0) return -errno;
    int error = 0;
    if (connect(fd, reinterpret_cast<const sockaddr*>(&address.storage), address.length) != 0) {
        error = errno == EINPROGRESS || errno == EINTR ? finish_connect(fd, deadline) : errno;
    }
    if (error != 0) {
        close(fd);
        return -error;
    }
    make_ready_for_modbus(fd);
    return fd;
}

}  // namespace

int milliseconds_until(Deadline deadline) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - MonotonicClock::now()).count();
    return static_cast<int>(std::clamp<long long>(left, 0, 3'600'000));
}

struct Resolver::Lookup {
    std::mutex mutex;
    std::condition_variable ended;
    bool done = false;
    LookupResult result;
};

Result<std::vector<Address>> Resolver::resolve(const std::string& host, int port, Deadline deadline) {
    LookupResult numeric = look_up(host, port, AI_NUMERICHOST);
    if (numeric.error == 0) return std::move(numeric.addresses);
    if (!pending_) {
        pending_ = std::make_shared<Lookup>();
        try {
            std::thread([lookup = pending_, host, port] {
                LookupResult result = look_up(host, port, 0);
                const std::lock_guard lock(lookup->mutex);
                lookup->result = std::move(result);
                lookup->done = true;
                lookup->ended.notify_all();
            }).detach();
        } catch (const std::system_error& error) {
            pending_.reset();
            return fail(NextStep::reopen_link, fmt::format("cannot look up {}: {}", host, error.what()));
        }
    }
    const std::shared_ptr<Lookup> lookup = pending_;
    std::unique_lock lock(lookup->mutex);
    if (!lookup->ended.wait_until(lock, deadline, [&] { return lookup->done; })) {
        return fail(NextStep::reopen_link, fmt::format("the look-up of the name {} takes too long", host));
    }
    pending_.reset();
    if (lookup->result.error != 0) {
        return fail(NextStep::reopen_link,
                    fmt::format("the name {} is not known: {}", host, gai_strerror(lookup->result.error)));
    }
    return lookup->result.addresses;
}

Result<int> connect_tcp(Resolver& resolver, const std::string& host, int port, Deadline deadline) {
    const auto addresses = resolver.resolve(host, port, deadline);
    if (!addresses) return std::unexpected(addresses.error());
    int error = ENOENT;
    for (std::size_t i = 0; i < addresses->size(); ++i) {
        // An address that swallows packets must leave time for the ones behind it.
        const auto now = MonotonicClock::now();
        const auto share = (deadline - now) / static_cast<long>(addresses->size() - i);
        const int fd = connect_address((*addresses)[i], now + share);
        if (fd >= 0) return fd;
        error = -fd;
    }
    return fail(NextStep::reopen_link,
                fmt::format("cannot connect to {} port {}: {}", host, port,
                            error == ETIMEDOUT ? "no answer in time" : error_text(error)));
}

}  // namespace thermbal
