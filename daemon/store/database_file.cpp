#include "database_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include "base/errno_text.hpp"
#include "sqlite.hpp"

namespace thermbal {

namespace {

std::filesystem::path folder_of(const std::filesystem::path& file) {
    return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

std::string holder(int fd) {
    std::array<char, 32> text{};
    const auto length = pread(fd, text.data(), text.size() - 1, 0);
    std::string pid(text.data(), length > 0 ? static_cast<std::size_t>(length) : 0);
    while (!pid.empty() && pid.back() == '\n') pid.pop_back();
    return pid.empty() ? "another process" : "process " + pid;
}

void sync_folder(const std::filesystem::path& file) {
    const auto folder = folder_of(file);
    const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return;
    fsync(fd);
    close(fd);
}

/// Unlike exists() without an error code, never throws: a disk that fails is no reason to end.
Result<bool> is_there(const std::filesystem::path& file) {
    std::error_code error;
    const bool there = std::filesystem::exists(file, error);
    if (error)
        return fail(NextStep::retry, fmt::format("{}: cannot be looked at: {}; check the disk and the folder",
                                                 file.string(), error.message()));
    return there;
}

/// The database last: as long as it is in place, the next start sees that it has to follow its log. After an
/// error each is where it was: a database that is still written needs its log.
Result<void> rename_with_log(const std::filesystem::path& database, const std::string& target) {
    std::vector<const char*> renamed;
    for (const char* suffix : {"-wal", "-shm", ""}) {
        std::error_code error;
        std::filesystem::rename(database.string() + suffix, target + suffix, error);
        if (!error) {
            renamed.push_back(suffix);
        } else if (error != std::errc::no_such_file_or_directory) {
            std::error_code ignored;
            for (const char* back : renamed)
                std::filesystem::rename(target + back, database.string() + back, ignored);
            return fail(NextStep::stop,
                        fmt::format("database {}: damaged, and cannot be renamed to {}: {}",
                                    database.string() + suffix, target + suffix, error.message()));
        }
    }
    sync_folder(database);
    return {};
}

}  // namespace

Result<WriterLock> WriterLock::take(const std::filesystem::path& database) {
    const auto path = database.string() + ".lock";
    WriterLock lock(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640));
    if (lock.fd_ < 0)
        return fail(
            NextStep::refuse_input,
            fmt::format("database {}: cannot open its lock {}: {}; the folder must exist and be writable",
                        database.string(), path, errno_text(errno)));
    if (flock(lock.fd_, LOCK_EX | LOCK_NB) != 0)
        return fail(NextStep::refuse_input,
                    fmt::format("database {}: {} is writing it already; stop that one, or name another file",
                                database.string(), holder(lock.fd_)));
    // The pid is for the message above only; the lock itself does not depend on it.
    const auto pid = fmt::format("{}\n", getpid());
    if (ftruncate(lock.fd_, 0) == 0 && pwrite(lock.fd_, pid.data(), pid.size(), 0) < 0) errno = 0;
    return lock;
}

WriterLock::WriterLock(WriterLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

WriterLock::~WriterLock() {
    if (fd_ >= 0) close(fd_);
}

Result<void> create_if_absent(const std::filesystem::path& database) {
    const int fd = ::open(database.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
    if (fd < 0)
        return fail(NextStep::refuse_input,
                    fmt::format("database {}: {}; the folder must exist and both must be writable",
                                database.string(), errno_text(errno)));
    close(fd);
    sync_folder(database);
    return {};
}

Result<bool> is_damaged(const std::filesystem::path& database, int busy_timeout_ms, bool all) {
    std::array<char, 16> header{};
    std::ifstream file(database, std::ios::binary);
    file.read(header.data(), header.size());
    if (file.gcount() == 0) return false;
    const bool zeroed = std::all_of(header.begin(), header.end(), [](char c) { return c == 0; });
    // A power cut while the file was made: its rollback journal says how to go back to an empty one.
    const auto journal = zeroed ? is_there(database.string() + "-journal") : Result<bool>(false);
    if (!journal) return std::unexpected(journal.error());
    if (zeroed && !*journal) return true;
    if (!zeroed && std::memcmp(header.data(), "SQLite format 3", header.size()) != 0)
        return fail(NextStep::refuse_input,
                    fmt::format("database {}: not an SQLite database; name another file", database.string()));

    auto probe = sqlite::Database::open(database, sqlite::OpenMode::read_write, busy_timeout_ms);
    if (!probe) {
        if (probe.error().next == NextStep::stop) return true;
        return std::unexpected(probe.error());
    }
    (*probe)->leave_wal_alone_on_close();
    auto check = (*probe)->query(all ? "PRAGMA quick_check(1)" : "SELECT 'ok', count(*) FROM sqlite_schema");
    const bool sound = check.next() && check.text(0) == "ok";
    if (auto status = check.status(); !status && status.error().next != NextStep::stop)
        return std::unexpected(status.error());
    return !sound;
}

Result<std::filesystem::path> put_aside(const std::filesystem::path& database, Moment now) {
    const auto seconds = static_cast<std::time_t>(now.wall_ns / 1'000'000'000);
    const auto stem = fmt::format("{}.damaged-{:%Y%m%dT%H%M%SZ}", database.string(), fmt::gmtime(seconds));
    std::string target = stem;
    auto taken = is_there(target);
    for (int i = 2; taken && *taken; ++i) {
        target = fmt::format("{}-{}", stem, i);
        taken = is_there(target);
    }
    if (!taken) return std::unexpected(taken.error());
    if (auto done = rename_with_log(database, target); !done) return std::unexpected(done.error());
    return std::filesystem::path(target);
}

Result<void> finish_put_aside(const std::filesystem::path& database) {
    const std::string begins = database.filename().string() + ".damaged-";
    constexpr std::string_view log = "-wal";
    std::error_code error;
    for (std::filesystem::directory_iterator entry(folder_of(database), error), end; !error && entry != end;
         entry.increment(error)) {
        std::string target = entry->path().string();
        if (!entry->path().filename().string().starts_with(begins) || !target.ends_with(log)) continue;
        target.resize(target.size() - log.size());
        const auto there = is_there(target);
        if (!there) return std::unexpected(there.error());
        if (!*there) return rename_with_log(database, target);
    }
    return {};
}

void remove_database(const std::filesystem::path& database) {
    std::error_code ignored;
    for (const char* suffix : {"", "-wal", "-shm", "-journal", ".lock"})
        std::filesystem::remove(database.string() + suffix, ignored);
}

Result<void> put_in_place(const std::filesystem::path& database, const std::filesystem::path& place) {
    std::error_code error;
    std::filesystem::rename(database, place, error);
    if (error)
        return fail(NextStep::retry, fmt::format("database {}: cannot be renamed to {}: {}",
                                                 database.string(), place.string(), error.message()));
    remove_database(database);
    sync_folder(place);
    return {};
}

Result<void> put_in_place_if_due(const std::filesystem::path& database, const std::filesystem::path& place) {
    std::error_code error;
    const bool whole = std::filesystem::file_size(database, error) > 0 && !error;
    const bool folded_in = std::filesystem::file_size(database.string() + "-wal", error) == 0 || error;
    if (!whole || !folded_in) return {};
    const auto taken = is_there(place);
    if (!taken) return std::unexpected(taken.error());
    if (*taken) return {};
    return put_in_place(database, place);
}

}  // namespace thermbal
