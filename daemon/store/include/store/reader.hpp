#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "series/recorded_test.hpp"
#include "store/records.hpp"

namespace thermbal {

namespace sqlite {
class Database;
}

/// Everything that can be asked of a database. Never writes. One thread at a time; several Readers may be
/// open while the daemon writes, each sees what was committed when its call began.
///
/// Errors: `retry` when the database is locked, altered, or the disk fails at the moment, `stop` when it is
/// damaged, `refuse_input` when what was asked for is not there or the file is not ours or newer than this
/// program.
class Reader {
  public:
    /// Opens an existing database read only (`mode=ro`).
    static Result<Reader> open(const std::filesystem::path& path);

    const std::filesystem::path& path() const;

    /// Newest first, at most `most` of them.
    Result<std::vector<StoredTest>> tests(std::int64_t most = INT64_MAX) const;
    Result<StoredTest> test(TestId id) const;
    /// The test that is running or declared, if there is one.
    Result<std::optional<StoredTest>> open_test() const;
    Result<std::optional<StoredTest>> newest_test() const;

    /// Scans with from_scan <= scan <= to_scan, ascending.
    Result<std::vector<ScanRecord>> scans(TestId id, std::int64_t from_scan = 0,
                                          std::int64_t to_scan = INT64_MAX) const;

    /// The same, one after the other: for a long test, which would fill the memory. `take` may move from its
    /// argument. After an error some may have been taken.
    Result<void> each_scan(TestId id, std::int64_t from_scan, std::int64_t to_scan,
                           const std::function<void(ScanRecord& scan)>& take) const;

    /// The good values as they were recorded, one row a stored scan (missed ones too, empty).
    Result<RecordedTest> recorded_test(TestId id) const;

    /// The good values on the grid: row k is scan k at k * period_s, NaN where there is no good value or no
    /// row. Only scans up to `until_scan`: with a declaration's window_end_scan, exactly what it had seen.
    Result<TestWindow> window(TestId id, std::int64_t until_scan = INT64_MAX) const;

    /// The CSV form of INTERFACES.
    Result<std::string> csv(TestId id) const;

    Result<std::vector<DeclarationRecord>> declarations(TestId id) const;
    /// The newest identification of each channel that has one, in channel order.
    Result<std::vector<IdentificationRecord>> latest_identifications(TestId id) const;
    /// All identifications of a channel, oldest first.
    Result<std::vector<IdentificationRecord>> identifications(TestId id, std::string_view channel) const;
    /// The newest `limit` events with an id above `after_id`, oldest first; of one test, or of everything
    /// without one.
    Result<std::vector<EventRecord>> events(std::optional<TestId> id, std::int64_t after_id = 0,
                                            std::int64_t limit = 1000) const;
    /// What earlier tests taught about a machine, newest first, at most `most` of them; of every machine with
    /// an empty name.
    Result<std::vector<ArchiveRecord>> archive(std::string_view machine, std::int64_t most = INT64_MAX) const;

    /// Empty when all is well: pages and constraints (integrity_check), references, the continuity of each
    /// test's grid, one sample a channel a scan, a value exactly where the quality is good, times that rise.
    Result<std::vector<Finding>> verify() const;

    /// Whether all pages of the file hang together. Reads all of it: seconds for a large one. Ends with an
    /// error (`retry`) once `stop` is requested, before it began or after.
    Result<bool> is_sound(std::stop_token stop = {}) const;

    /// A consistent copy into a new file, while the daemon goes on writing. Refuses to overwrite.
    Result<void> backup(const std::filesystem::path& copy) const;

    Reader(Reader&&) noexcept;
    Reader& operator=(Reader&&) noexcept;
    ~Reader();

  private:
    friend class Store;
    friend class Feed;
    explicit Reader(std::shared_ptr<sqlite::Database> database);
    std::shared_ptr<sqlite::Database> database_;
};

}  // namespace thermbal
