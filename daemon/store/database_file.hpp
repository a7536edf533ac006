#pragma once

#include <filesystem>
#include <optional>

#include "base/error.hpp"
#include "store/records.hpp"

namespace thermbal {

/// The exclusive right to write a database: flock on `<database>.lock`, which the kernel gives back when the
/// process ends, however it ends.
class WriterLock {
  public:
    /// `refuse_input` with the holder's process id when another Store has it.
    static Result<WriterLock> take(const std::filesystem::path& database);
    WriterLock(WriterLock&&) noexcept;
    WriterLock& operator=(WriterLock&&) = delete;
    ~WriterLock();

  private:
    explicit WriterLock(int fd) : fd_(fd) {}
    int fd_;
};

/// Creates an empty file (mode 0640) with its folder entry on the disk; leaves an existing one alone.
Result<void> create_if_absent(const std::filesystem::path& database);

/// Whether the head, or with `all` any page or the schema is damaged. Changes nothing. A file that is no
/// SQLite database at all is `refuse_input`: it is probably somebody else's.
Result<bool> is_damaged(const std::filesystem::path& database, int busy_timeout_ms, bool all);

/// Renames a database with its -wal and -shm to <name>.damaged-<time>; returns the new name. Errors: `stop`
/// where it cannot be renamed, `retry` where the disk does not say what is there.
Result<std::filesystem::path> put_aside(const std::filesystem::path& database, Moment now);

/// What put_aside would have done had the process not ended between its renames: where a log was set aside
/// without its database, the database follows. Errors as put_aside.
Result<void> finish_put_aside(const std::filesystem::path& database);

/// Removes a database that nobody needs, with all that lies beside it.
void remove_database(const std::filesystem::path& database);

/// Renames a closed database whose log is empty; what lay beside it is removed.
Result<void> put_in_place(const std::filesystem::path& database, const std::filesystem::path& place);

/// What put_in_place would have done had the process not ended before: `database` is whole and nothing is in
/// `place`. Anything else is left as it is.
Result<void> put_in_place_if_due(const std::filesystem::path& database, const std::filesystem::path& place);

}  // namespace thermbal
