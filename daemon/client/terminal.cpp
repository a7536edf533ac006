#include "terminal.hpp"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/signalfd.h>
#include <unistd.h>

namespace thermbal {
namespace {

// xterm's alternate screen, cursor and autowrap modes; every terminal in use today knows them.
constexpr std::string_view enter = "\x1b[?1049h\x1b[?25l\x1b[?7l\x1b[2J";
constexpr std::string_view leave = "\x1b[?7h\x1b[?25h\x1b[?1049l\x1b[0m";

void write_all(std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = write(STDOUT_FILENO, bytes.data(), bytes.size());
        if (written > 0) {
            bytes.remove_prefix(static_cast<std::size_t>(written));
        } else if (errno == EAGAIN) {
            pollfd waiting{STDOUT_FILENO, POLLOUT, 0};
            poll(&waiting, 1, 1000);
        } else if (errno != EINTR) {
            return;  // the terminal is gone; SIGHUP says so too
        }
    }
}

sigset_t handled_signals() {
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGWINCH, SIGINT, SIGTERM, SIGHUP, SIGTSTP}) sigaddset(&signals, signal);
    return signals;
}

}  // namespace

Result<Terminal> Terminal::open() {
    const sigset_t signals = handled_signals();
    const int fd = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
    if (fd < 0) return fail(NextStep::stop, fmt::format("signals: {}", strerrordesc_np(errno)));
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    return Terminal(fd);
}

Terminal::Terminal(int signal_fd) : signal_fd_(signal_fd) {
    has_keyboard_ = tcgetattr(STDIN_FILENO, &before_) == 0;
    take();
}

Terminal::Terminal(Terminal&& other) noexcept
    : signal_fd_(std::exchange(other.signal_fd_, -1)),
      has_keyboard_(other.has_keyboard_),
      before_(other.before_) {}

Terminal::~Terminal() {
    if (signal_fd_ < 0) return;
    give_back();
    close(signal_fd_);
    const sigset_t signals = handled_signals();
    pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

void Terminal::take() {
    if (has_keyboard_) {
        termios raw = before_;
        raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
        raw.c_cc[VMIN] = 1;
        raw.c_cc[VTIME] = 0;
        tcsetattr(STDIN_FILENO, TCSANOW, &raw);
    }
    write_all(enter);
}

void Terminal::give_back() const {
    write_all(leave);
    if (has_keyboard_) tcsetattr(STDIN_FILENO, TCSADRAIN, &before_);
}

FrameSize Terminal::size() const {
    winsize size{};
    if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0) return {};
    return {size.ws_row, size.ws_col};
}

void Terminal::show(std::string_view frame) const {
    // Each line is cleared before it is written: behind a full one the cursor still stands on its last
    // column.
    std::string screen = "\x1b[H";
    while (true) {
        const std::size_t end = frame.find('\n');
        screen += "\x1b[2K";
        screen += frame.substr(0, end);
        if (end == std::string_view::npos) break;
        screen += "\r\n";
        frame.remove_prefix(end + 1);
    }
    write_all(screen);
}

int Terminal::take_signal() const {
    signalfd_siginfo info{};
    return read(signal_fd_, &info, sizeof info) == sizeof info ? static_cast<int>(info.ssi_signo) : 0;
}

void Terminal::suspend() {
    give_back();
    raise(SIGSTOP);
    take();
}

}  // namespace thermbal
