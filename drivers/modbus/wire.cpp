#include "wire.hpp"

#include <array>
#include <cerrno>
#include <cmath>
#include <random>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

namespace thermbal {
namespace {

std::unexpected<Error> lost(std::string message) {
    return fail(NextStep::reopen_link, std::move(message));
}

speed_t termios_speed(int baud) {
    switch (baud) {
        case 1200:
            return B1200;
        case 2400:
            return B2400;
        case 4800:
            return B4800;
        case 9600:
            return B9600;
        case 19200:
            return B19200;
        case 38400:
            return B38400;
        case 57600:
            return B57600;
        case 115200:
            return B115200;
        case 230400:
            return B230400;
        default:
            return B0;
    }
}

bool is_pseudo_terminal(dev_t device) {
    return major(device) >= 136 && major(device) <= 143;
}

/// libmodbus does not look whether the driver took what it asked for. A pseudo-terminal has no parity to
/// take.
bool port_took_settings(int fd, dev_t device, const LinkOptions& options) {
    termios settings{};
    if (tcgetattr(fd, &settings) != 0) return false;
    const speed_t speed = termios_speed(options.baud);
    if (cfgetispeed(&settings) != speed || cfgetospeed(&settings) != speed) return false;
    if (is_pseudo_terminal(device)) return true;
    const bool parity = (settings.c_cflag & PARENB) != 0;
    const bool odd = (settings.c_cflag & PARODD) != 0;
    const bool two_stop_bits = (settings.c_cflag & CSTOPB) != 0;
    return parity == (options.parity != 'N') && (!parity || odd == (options.parity == 'O')) &&
           two_stop_bits == (options.stop_bits == 2);
}

/// A transaction id that no earlier connection of any process is likely to have used lately.
std::uint16_t first_transaction_id() {
    return static_cast<std::uint16_t>(std::random_device{}());
}

}  // namespace

struct Wire::Context {
    explicit Context(modbus_t* made) : modbus(made) {}
    ~Context() {
        modbus_close(modbus);
        modbus_free(modbus);
    }
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    modbus_t* modbus;
};

Wire::Wire(LinkOptions options) : options_(std::move(options)), transaction_id_(first_transaction_id()) {}

Wire::~Wire() {
    close();
}

bool Wire::is_open() const {
    return context_ != nullptr;
}

void Wire::close() {
    if (!context_) return;
    // Unsent bytes in a stuck serial port would hold up its closing.
    if (options_.transport == Transport::rtu) tcflush(modbus_get_socket(context_->modbus), TCIOFLUSH);
    context_.reset();
    lock_.release();
}

Result<void> Wire::open() {
    close();
    auto opened = options_.transport == Transport::rtu ? open_serial() : open_socket();
    if (opened) opened = check_descriptor();
    if (!opened) close();
    return opened;
}

Result<void> Wire::make_context(const char* device) {
    modbus_t* made =
        options_.transport == Transport::tcp
            ? modbus_new_tcp("127.0.0.1", options_.port)
            : modbus_new_rtu(device, options_.baud, options_.parity, options_.data_bits, options_.stop_bits);
    if (made == nullptr) return lost(fmt::format("cannot set up the line: {}", modbus_strerror(errno)));
    context_ = std::make_unique<Context>(made);
    const double whole_s = std::floor(options_.response_timeout_s);
    const auto microseconds = static_cast<std::uint32_t>((options_.response_timeout_s - whole_s) * 1e6);
    modbus_set_error_recovery(made, MODBUS_ERROR_RECOVERY_NONE);
    // A byte timeout would start anew with every byte: 0 makes the response timeout cover the whole reply.
    if (modbus_set_byte_timeout(made, 0, 0) != 0 ||
        modbus_set_response_timeout(made, static_cast<std::uint32_t>(whole_s), microseconds) != 0) {
        return lost(fmt::format("response timeout of {} s refused: {}", options_.response_timeout_s,
                                modbus_strerror(errno)));
    }
    return {};
}

Result<void> Wire::open_serial() {
    device_ = options_.device;
    if (options_.find_device) {
        auto found = options_.find_device();
        if (!found) return std::unexpected(found.error());
        device_ = std::move(*found);
    }
    if (auto locked = lock_.take_lock_file(device_); !locked) return locked;
    if (auto made = make_context(device_.c_str()); !made) return made;
    if (modbus_connect(context_->modbus) != 0) {
        const int error = errno;
        if (error == EBUSY) {
            return lost(fmt::format("serial port {} is in use{}: one program a port", device_,
                                    other_user_of(device_)));
        }
        return lost(fmt::format("cannot open serial port {}: {}; plug the adapter in, or correct `device`",
                                device_, modbus_strerror(error)));
    }
    const int fd = modbus_get_socket(context_->modbus);
    fcntl(fd, F_SETFD, FD_CLOEXEC);
    struct stat opened{};
    if (fstat(fd, &opened) != 0) return lost(fmt::format("serial port {} has gone", device_));
    device_number_ = opened.st_rdev;
    device_inode_ = opened.st_ino;
    if (auto taken = lock_.take_descriptor(device_, fd); !taken) return taken;
    if (!port_took_settings(fd, opened.st_rdev, options_)) {
        return lost(fmt::format("serial port {} does not take {} baud 8{}{}", device_, options_.baud,
                                options_.parity, options_.stop_bits));
    }
    return {};
}

Result<void> Wire::open_socket() {
    const Deadline deadline =
        MonotonicClock::now() + std::chrono::duration_cast<MonotonicClock::duration>(
                                    std::chrono::duration<double>(options_.connect_timeout_s));
    const auto fd = connect_tcp(resolver_, options_.host, options_.port, deadline);
    if (!fd) return std::unexpected(fd.error());
    // RTU framing over a socket: libmodbus only ever reads and writes the descriptor that it is given.
    auto made = make_context("socket");
    if (!made) {
        ::close(*fd);
        return made;
    }
    modbus_set_socket(context_->modbus, *fd);
    return {};
}

Result<void> Wire::check_descriptor() {
    // libmodbus waits with select, whose sets end there.
    if (modbus_get_socket(context_->modbus) < FD_SETSIZE) return {};
    return lost(fmt::format("this process has more than {} descriptors open", FD_SETSIZE));
}

bool Wire::device_is_same() const {
    if (options_.transport != Transport::rtu) return true;
    struct stat now{};
    return stat(device_.c_str(), &now) == 0 && now.st_rdev == device_number_ && now.st_ino == device_inode_;
}

Result<void> Wire::send(const Request& request) {
    int sent = 0;
    std::size_t length = 0;
    if (options_.transport == Transport::tcp) {
        // modbus_send_raw_request sends transaction 0 every time, so that a late reply would fit any request.
        const std::vector<std::uint8_t> frame = tcp_frame(++transaction_id_, request);
        length = frame.size();
        sent = static_cast<int>(
            ::send(modbus_get_socket(context_->modbus), frame.data(), length, MSG_NOSIGNAL | MSG_DONTWAIT));
    } else {
        std::vector<std::uint8_t> frame = request_pdu(request);
        frame.insert(frame.begin(), static_cast<std::uint8_t>(request.unit_id));
        length = frame.size() + 2;
        modbus_set_slave(context_->modbus, request.unit_id);
        sent = modbus_send_raw_request(context_->modbus, frame.data(), static_cast<int>(frame.size()));
    }
    if (sent == static_cast<int>(length)) return {};
    return lost(fmt::format("cannot send the request: {}",
                            sent < 0 ? modbus_strerror(errno) : "only a part went out"));
}

Result<std::vector<std::uint16_t>> Wire::receive(const Request& request) {
    timed_out_ = false;
    std::array<std::uint8_t, MODBUS_MAX_ADU_LENGTH + 1> buffer{};
    const int received = modbus_receive_confirmation(context_->modbus, buffer.data());
    if (received < 0) {
        timed_out_ = errno == ETIMEDOUT || errno == EINPROGRESS;
        if (timed_out_) {
            return lost(fmt::format("unit {} did not answer within {} s", request.unit_id,
                                    options_.response_timeout_s));
        }
        return lost(fmt::format("unit {}: {}", request.unit_id, modbus_strerror(errno)));
    }
    const std::span<const std::uint8_t> frame(buffer.data(), static_cast<std::size_t>(received));
    const auto pdu = options_.transport == Transport::tcp
                         ? pdu_of_tcp_reply(frame, transaction_id_, request.unit_id)
                         : pdu_of_rtu_reply(frame, request.unit_id);
    if (!pdu) return std::unexpected(pdu.error());
    return check_reply(request, *pdu);
}

bool Wire::readable(double wait_s) const {
    pollfd waiting{.fd = modbus_get_socket(context_->modbus), .events = POLLIN, .revents = 0};
    const Deadline deadline = MonotonicClock::now() + std::chrono::duration_cast<MonotonicClock::duration>(
                                                          std::chrono::duration<double>(wait_s));
    for (;;) {
        const int ready = poll(&waiting, 1, milliseconds_until(deadline));
        if (ready >= 0) return ready > 0;
        if (errno != EINTR) return true;
    }
}

bool Wire::has_bytes() const {
    int count = 0;
    return ioctl(modbus_get_socket(context_->modbus), FIONREAD, &count) == 0 && count > 0;
}

std::optional<std::size_t> Wire::discard() {
    std::size_t discarded = 0;
    std::array<std::uint8_t, 512> buffer{};
    // Bounded: a line that never falls silent is given up by the link, not read for ever here.
    for (int chunk = 0; chunk < 64 && readable(0.0); ++chunk) {
        const ssize_t got = ::read(modbus_get_socket(context_->modbus), buffer.data(), buffer.size());
        if (got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN)) return std::nullopt;
        if (got > 0) discarded += static_cast<std::size_t>(got);
    }
    return discarded;
}

}  // namespace thermbal
