#include "listener.hpp"

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <systemd/sd-daemon.h>

#include "base/errno_text.hpp"

namespace thermbal {

namespace {

std::unexpected<Error> refuse(const std::filesystem::path& path, const std::string& what) {
    return fail(NextStep::refuse_input, fmt::format("socket {}: {}", path.string(), what));
}

sockaddr_un address_of(const std::filesystem::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    return address;
}

Descriptor stream_socket() {
    return Descriptor(socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
}

/// A file left by a daemon that is gone refuses connections. Anything else is not ours to remove.
Result<void> clear_stale(const std::filesystem::path& path) {
    struct stat file{};
    if (lstat(path.c_str(), &file) != 0) {
        if (errno == ENOENT) return {};
        return refuse(path, errno_text(errno));
    }
    if (!S_ISSOCK(file.st_mode)) return refuse(path, "is there and is no socket; name another path");
    const auto address = address_of(path);
    const Descriptor probe = stream_socket();
    if (probe.get() < 0) return refuse(path, errno_text(errno));
    if (connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
        errno == EAGAIN)
        return refuse(path, "another daemon answers on it; stop that one, or name another path");
    if (errno != ECONNREFUSED) return refuse(path, errno_text(errno));
    if (unlink(path.c_str()) != 0 && errno != ENOENT)
        return refuse(path,
                      fmt::format("left by a daemon that is gone, cannot be removed: {}", errno_text(errno)));
    return {};
}

}  // namespace

Result<Listener> Listener::open(const std::filesystem::path& path, mode_t mode) {
    const int passed = sd_listen_fds(0);
    for (int fd = SD_LISTEN_FDS_START; fd < SD_LISTEN_FDS_START + passed; ++fd) {
        if (sd_is_socket_unix(fd, SOCK_STREAM, 1, nullptr, 0) <= 0) continue;
        fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
        return Listener(Descriptor(fd));
    }
    if (passed > 0)
        return fail(
            NextStep::refuse_input,
            "systemd passed no listening Unix stream socket; use ListenStream=/path in the socket unit");
    return bind_at(path, mode);
}

Result<Listener> Listener::bind_at(const std::filesystem::path& path, mode_t mode) {
    if (path.empty() || path.string().size() >= sizeof(sockaddr_un::sun_path))
        return refuse(path,
                      fmt::format("a path of 1 to {} bytes is needed", sizeof(sockaddr_un::sun_path) - 1));
    if (auto cleared = clear_stale(path); !cleared) return std::unexpected(cleared.error());
    Listener listener(stream_socket());
    if (!listener.socket_.valid()) return refuse(path, errno_text(errno));
    const auto address = address_of(path);
    if (bind(listener.fd(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        return refuse(path, fmt::format("{}; the folder must exist and be writable", errno_text(errno)));
    listener.path_ = path;
    listener.file_.emplace();
    // Nobody can connect before listen: the mode is right from the first moment on.
    if (lstat(path.c_str(), &*listener.file_) != 0 || chmod(path.c_str(), mode) != 0 ||
        listen(listener.fd(), 64) != 0)
        return refuse(path, errno_text(errno));
    return listener;
}

Listener::~Listener() {
    if (!socket_.valid() || !file_) return;
    struct stat now{};
    const bool still_ours =
        lstat(path_.c_str(), &now) == 0 && now.st_ino == file_->st_ino && now.st_dev == file_->st_dev;
    if (still_ours) unlink(path_.c_str());
}

}  // namespace thermbal
