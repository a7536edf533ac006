#include "scripted_peer.hpp"

#include <array>
#include <cstdlib>
#include <stdexcept>

#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

namespace thermbal::test {
namespace {

bool wait_readable(int fd, int milliseconds) {
    pollfd waiting{.fd = fd, .events = POLLIN, .revents = 0};
    return poll(&waiting, 1, milliseconds) > 0;
}

std::uint8_t byte(int value) {
    return static_cast<std::uint8_t>(value & 0xFF);
}

}  // namespace

Bytes with_crc(Bytes frame) {
    unsigned crc = 0xFFFF;
    for (const std::uint8_t value : frame) {
        crc ^= value;
        for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1U) ^ 0xA001U : crc >> 1U;
    }
    frame.push_back(byte(static_cast<int>(crc)));
    frame.push_back(byte(static_cast<int>(crc >> 8U)));
    return frame;
}

int Heard::unit() const {
    return transport == Transport::tcp ? frame[6] : frame[0];
}
int Heard::function() const {
    return transport == Transport::tcp ? frame[7] : frame[1];
}

int Heard::address() const {
    const std::size_t at = transport == Transport::tcp ? 8 : 2;
    return frame[at] << 8 | frame[at + 1];
}

int Heard::count() const {
    const std::size_t at = transport == Transport::tcp ? 10 : 4;
    return frame[at] << 8 | frame[at + 1];
}

Bytes Heard::frame_around(const Bytes& pdu) const {
    Bytes reply;
    if (transport == Transport::tcp) {
        const int length = static_cast<int>(pdu.size()) + 1;
        reply = {frame[0], frame[1], 0, 0, byte(length >> 8), byte(length)};
    }
    reply.push_back(byte(unit()));
    for (const std::uint8_t value : pdu) reply.push_back(value);
    return transport == Transport::tcp ? reply : with_crc(reply);
}

Bytes Heard::right_reply() const {
    if (function() == 5 || function() == 6) return frame;
    Bytes pdu{byte(function()), byte(2 * count())};
    for (int i = 0; i < count(); ++i) {
        const int value = number * 1000 + address() + i;
        pdu.push_back(byte(value >> 8));
        pdu.push_back(byte(value));
    }
    return frame_around(pdu);
}

Bytes Heard::exception(int code) const {
    return frame_around({byte(function() | 0x80), byte(code)});
}

ScriptedPeer::ScriptedPeer(Transport transport, Script script)
    : transport_(transport), script_(std::move(script)) {
    if (transport_ == Transport::rtu) {
        master_ = posix_openpt(O_RDWR | O_NOCTTY);
        std::array<char, 128> name{};
        if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0 ||
            ptsname_r(master_, name.data(), name.size()) != 0) {
            throw std::runtime_error("no pseudo-terminal");
        }
        device_ = name.data();
        // Held open so that the master does not see a hang-up between two openings by the link.
        slave_ = open(device_.c_str(), O_RDWR | O_NOCTTY);
        termios raw{};
        tcgetattr(slave_, &raw);
        cfmakeraw(&raw);
        tcsetattr(slave_, TCSANOW, &raw);
        thread_ = std::thread([this] { serve(master_); });
        return;
    }
    listener_ = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    if (bind(listener_, reinterpret_cast<sockaddr*>(&address), length) != 0 || listen(listener_, 8) != 0 ||
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length) != 0) {
        throw std::runtime_error("no listening socket");
    }
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve_tcp(); });
}

ScriptedPeer::~ScriptedPeer() {
    stopping_ = true;
    thread_.join();
    for (const int fd : {listener_, master_, slave_}) {
        if (fd >= 0) close(fd);
    }
}

LinkOptions ScriptedPeer::options() const {
    LinkOptions options;
    options.name = "test";
    options.transport = transport_;
    options.host = "127.0.0.1";
    options.port = port_;
    options.device = device_;
    options.baud = 115200;
    options.response_timeout_s = 0.1;
    options.connect_timeout_s = 0.5;
    options.quiet_s = 0.01;
    options.first_pause_s = options.longest_pause_s = 0.0;  // a test has no period between two calls
    return options;
}

void ScriptedPeer::serve_tcp() {
    while (!stopping_) {
        if (!wait_readable(listener_, 10)) continue;
        const int fd = accept(listener_, nullptr, nullptr);
        ++connections_;
        serve(fd);
        close(fd);
    }
}

void ScriptedPeer::serve(int fd) {
    const std::size_t length = transport_ == Transport::tcp ? 12 : 8;
    bool hung_up = false;
    Bytes frame;
    while (!stopping_ && !hung_up) {
        if (!wait_readable(fd, 10)) continue;
        Bytes part(length - frame.size());
        const ssize_t got = read(fd, part.data(), part.size());
        if (got <= 0) return;
        frame.insert(frame.end(), part.begin(), part.begin() + got);
        if (frame.size() < length) continue;
        const Heard heard{.transport = transport_, .number = ++requests_, .frame = frame};
        frame.clear();
        const Send send_bytes = [&](const Bytes& reply) {
            if (transport_ != Transport::rtu)
                ::send(fd, reply.data(), reply.size(), MSG_NOSIGNAL);
            else if (write(fd, reply.data(), reply.size()) < 0)
                hung_up = true;
        };
        script_(heard, send_bytes, [&] { hung_up = true; });
    }
}

}  // namespace thermbal::test
