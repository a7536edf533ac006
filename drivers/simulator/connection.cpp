#include "simulator/connection.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <sys/socket.h>
#include <unistd.h>

namespace thermbal {
namespace {

bool try_again(int error) {
    return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

}  // namespace

void Connection::read(std::int64_t now_ns) {
    std::uint8_t block[1024];
    const ssize_t got = ::read(fd_.get(), block, sizeof block);
    if (got > 0) {
        received_.insert(received_.end(), block, block + got);
        last_byte_ns_ = now_ns;
        return;
    }
    if (got < 0 && try_again(errno)) return;
    drop();
}

void Connection::serve(const ServeRequest& answer, const ServerLimits& limits, std::int64_t now_ns) {
    answer_received(answer, limits, now_ns);
    send_due(now_ns);
    flush(limits);
}

void Connection::answer_received(const ServeRequest& answer, const ServerLimits& limits,
                                 std::int64_t now_ns) {
    while (!closing_ && !received_.empty()) {
        const bool silence = now_ns - last_byte_ns_ >= limits.silence_ns;
        const ParsedRequest parsed =
            framing_ == Framing::tcp ? parse_tcp_request(received_) : parse_rtu_request(received_, silence);
        if (parsed.kind == ParsedRequest::Kind::incomplete) break;
        received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(parsed.consumed));
        if (parsed.kind == ParsedRequest::Kind::broken) closing_ = true;
        if (parsed.kind != ParsedRequest::Kind::request) continue;
        if (pending_.size() >= limits.pending_replies) continue;
        for (Delivery& delivery : answer(framing_, parsed.request, now_ns)) {
            const auto delay_ns = static_cast<std::int64_t>(delivery.delay_s * 1e9);
            pending_.push_back({.due_ns = now_ns + delay_ns, .delivery = std::move(delivery)});
        }
    }
}

void Connection::send_due(std::int64_t now_ns) {
    std::vector<Pending> later;
    for (Pending& pending : pending_) {
        if (pending.due_ns > now_ns) {
            later.push_back(std::move(pending));
            continue;
        }
        const Bytes& bytes = pending.delivery.bytes;
        unsent_.insert(unsent_.end(), bytes.begin(), bytes.end());
        closing_ = closing_ || pending.delivery.hang_up;
    }
    pending_ = std::move(later);
}

void Connection::flush(const ServerLimits& limits) {
    if (unsent_.empty()) return;
    const ssize_t sent = framing_ == Framing::tcp
                             ? send(fd_.get(), unsent_.data(), unsent_.size(), MSG_NOSIGNAL)
                             : write(fd_.get(), unsent_.data(), unsent_.size());
    if (sent > 0) {
        unsent_.erase(unsent_.begin(), unsent_.begin() + sent);
    } else if (sent < 0 && !try_again(errno)) {
        drop();
    }
    if (unsent_.size() > limits.unsent_bytes) drop();
}

void Connection::drop() {
    received_.clear();
    pending_.clear();
    unsent_.clear();
    closing_ = framing_ == Framing::tcp;
}

std::int64_t Connection::next_due_ns(const ServerLimits& limits, std::int64_t until_ns) const {
    for (const Pending& pending : pending_) until_ns = std::min(until_ns, pending.due_ns);
    if (framing_ == Framing::rtu && !received_.empty()) {
        until_ns = std::min(until_ns, last_byte_ns_ + limits.silence_ns);
    }
    return until_ns;
}

}  // namespace thermbal
