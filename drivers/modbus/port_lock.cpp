#include "port_lock.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace thermbal {
namespace {

namespace fs = std::filesystem;

std::string real_path(const std::string& device) {
    std::error_code error;
    const fs::path path = fs::canonical(device, error);
    return error ? device : path.string();
}

std::string lock_file_of(const std::string& device) {
    std::string name = real_path(device);
    if (name.starts_with("/dev/")) name.erase(0, 5);
    std::ranges::replace(name, '/', '_');
    return "/run/lock/LCK.." + name;
}

std::string first_line(const fs::path& path) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    return line;
}

std::string process_name(long pid) {
    return first_line(fmt::format("/proc/{}/comm", pid));
}

/// The living process whose lock file this is; 0 without one.
long owner_of(const std::string& lock_file) {
    const std::string line = first_line(lock_file);
    const std::size_t start = line.find_first_not_of(' ');
    if (start == std::string::npos) return 0;
    long pid = 0;
    std::from_chars(line.data() + start, line.data() + line.size(), pid);
    if (pid <= 0) return 0;
    const bool alive = kill(static_cast<pid_t>(pid), 0) == 0 || errno == EPERM;
    return alive ? pid : 0;
}

bool has_open(const fs::path& process, const std::string& device) {
    std::error_code error;
    for (fs::directory_iterator entry(process / "fd", error), end; !error && entry != end;
         entry.increment(error)) {
        std::error_code unreadable;
        if (fs::read_symlink(entry->path(), unreadable) == device && !unreadable) return true;
    }
    return false;
}

bool is_pid(const std::string& name) {
    return !name.empty() && std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

std::string other_user_of(const std::string& device) {
    const std::string path = real_path(device);
    std::error_code error;
    for (fs::directory_iterator entry("/proc", error), end; !error && entry != end; entry.increment(error)) {
        const std::string pid = entry->path().filename().string();
        if (!is_pid(pid) || pid == std::to_string(getpid())) continue;
        if (has_open(entry->path(), path))
            return fmt::format(" by pid {} ({})", pid, process_name(std::stol(pid)));
    }
    return {};
}

PortLock::~PortLock() {
    release();
}

Result<void> PortLock::take_lock_file(const std::string& device) {
    release();
    const std::string path = lock_file_of(device);
    for (int attempt = 0; attempt < 2; ++attempt) {
        const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
        if (fd >= 0) {
            const std::string content = fmt::format("{:10d}\n", getpid());
            const bool written =
                ::write(fd, content.data(), content.size()) == static_cast<ssize_t>(content.size());
            ::close(fd);
            if (written)
                lock_file_ = path;
            else
                ::unlink(path.c_str());
            return {};
        }
        if (errno != EEXIST) return {};
        const long owner = owner_of(path);
        if (owner == getpid()) return {};
        if (owner != 0) {
            return fail(NextStep::reopen_link,
                        fmt::format("serial port {} is in use by pid {} ({}), says {}: stop that program",
                                    device, owner, process_name(owner), path));
        }
        if (::unlink(path.c_str()) != 0) return {};
    }
    return {};
}

Result<void> PortLock::take_descriptor(const std::string& device, int fd) {
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        return fail(NextStep::reopen_link, fmt::format("serial port {} is in use{}: one program a port",
                                                       device, other_user_of(device)));
    }
    ::ioctl(fd, TIOCEXCL);
    return {};
}

void PortLock::release() {
    if (lock_file_.empty()) return;
    ::unlink(lock_file_.c_str());
    lock_file_.clear();
}

}  // namespace thermbal
