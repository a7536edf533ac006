// Replies over a real socket, through libmodbus: Modbus TCP and RTU over TCP. The peer sends what the input
// says, in the pieces that it says; half of the inputs get the right transaction id or CRC, so that more than
// the first check is reached. Registers that the link gives have to be those of a sound reply to the last
// request.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "check.hpp"
#include "modbus/link.hpp"
#include "simulator/frames.hpp"

namespace {

using namespace thermbal;

constexpr int count = 4;
constexpr int unit_id = 1;

/// Sends the same bytes after every request that it gets.
class Peer {
  public:
    Peer() : listener_(socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t length = sizeof address;
        FUZZ_CHECK(bind(listener_, reinterpret_cast<sockaddr*>(&address), length) == 0);
        FUZZ_CHECK(listen(listener_, 16) == 0);
        FUZZ_CHECK(getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length) == 0);
        port_ = ntohs(address.sin_port);
        std::thread([this] { serve(); }).detach();
    }

    int port() const { return port_; }

    void answer_with(Bytes reply, bool tcp, bool mend, std::size_t piece) {
        const std::lock_guard lock(mutex_);
        reply_ = std::move(reply);
        tcp_ = tcp;
        mend_ = mend;
        piece_ = piece;
    }
    Bytes last_sent() {
        const std::lock_guard lock(mutex_);
        return sent_;
    }
    Bytes last_request() {
        const std::lock_guard lock(mutex_);
        return request_;
    }

  private:
    void serve() {
        for (;;) {
            const int fd = accept(listener_, nullptr, nullptr);
            if (fd < 0) continue;
            std::uint8_t request[64];
            for (ssize_t got = 0; (got = read(fd, request, sizeof request)) > 0;) {
                reply_to(fd, Bytes(request, request + got));
            }
            close(fd);
        }
    }

    void reply_to(int fd, Bytes request) {
        const std::lock_guard lock(mutex_);
        Bytes reply = reply_;
        if (mend_ && tcp_ && reply.size() >= 6) {
            std::copy_n(request.begin(), 4, reply.begin());
            reply[4] = static_cast<std::uint8_t>((reply.size() - 6) / 256);
            reply[5] = static_cast<std::uint8_t>((reply.size() - 6) % 256);
        }
        if (mend_ && !tcp_) {
            const std::uint16_t crc = modbus_crc(reply);
            reply.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
            reply.push_back(static_cast<std::uint8_t>(crc >> 8U));
        }
        request_ = std::move(request);
        sent_ = reply;
        const std::size_t piece = piece_ == 0 ? reply.size() : piece_;
        for (std::size_t at = 0; at < reply.size(); at += piece) {
            const std::size_t length = std::min(piece, reply.size() - at);
            if (send(fd, reply.data() + at, length, MSG_NOSIGNAL) < 0) return;
        }
    }

    int listener_;
    int port_ = 0;
    std::mutex mutex_;
    Bytes reply_;
    Bytes request_;
    Bytes sent_;
    bool tcp_ = true;
    bool mend_ = false;
    std::size_t piece_ = 0;
};

void check_answer(Peer& peer, bool tcp, const std::vector<std::uint16_t>& registers) {
    FUZZ_CHECK(registers.size() == count);
    const Bytes request = peer.last_request();
    const Bytes sent = peer.last_sent();
    Bytes pdu = {3, 2 * count};
    for (const std::uint16_t word : registers) {
        pdu.push_back(static_cast<std::uint8_t>(word >> 8U));
        pdu.push_back(static_cast<std::uint8_t>(word & 0xFFU));
    }
    const auto transaction = static_cast<std::uint16_t>(request[0] * 256 + request[1]);
    const Bytes sound = tcp ? tcp_frame(transaction, unit_id, pdu) : rtu_frame(unit_id, pdu);
    FUZZ_CHECK(sent.size() >= sound.size() && std::equal(sound.begin(), sound.end(), sent.begin()));
    FUZZ_CHECK(tcp || sent.size() == sound.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1 || size > 600) return 0;
    static Peer peer;
    const bool tcp = data[0] % 2 == 0;
    const bool mend = data[0] / 2 % 2 == 0;
    peer.answer_with(Bytes(data + 1, data + size), tcp, mend, data[0] / 4 % 16);

    LinkOptions options;
    options.name = "fuzz";
    options.transport = tcp ? Transport::tcp : Transport::rtu_over_tcp;
    options.port = peer.port();
    options.response_timeout_s = 0.002;
    options.connect_timeout_s = 0.5;
    options.quiet_s = 0.001;
    options.first_pause_s = options.longest_pause_s = 0.0;
    const auto link = make_link(options);
    for (int call = 0; call < 2; ++call) {
        const auto began = std::chrono::steady_clock::now();
        const auto registers = link->read_block(unit_id, 3, 0, count);
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
        FUZZ_CHECK(took.count() < longest_call_s(options) + 2.0);
        if (registers) check_answer(peer, tcp, *registers);
    }
    return 0;
}
