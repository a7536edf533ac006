#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "store/reader.hpp"
#include "store/records.hpp"

namespace thermbal {

/// A test that was open when the daemon ended, with everything it needs to go on but its scans
/// (Reader::each_scan): those of a week may be millions of samples.
struct ResumedTest {
    StoredTest test;
    std::vector<DeclarationRecord> declarations;
    std::vector<IdentificationRecord> identifications;  ///< the newest of each channel
};

struct StoreOptions {
    int busy_timeout_ms = 2000;     ///< how long a call waits for another program's lock before `retry`
    bool set_aside_damaged = true;  ///< a damaged file is renamed and a new one begun; otherwise `stop`
    /// A larger file is not read through before it is opened: a restart in a test must not cost scans. Its
    /// owner checks it beside the scans (FileCheck).
    std::uintmax_t checked_at_once_bytes = 4'194'304;
};

/// What the daemon knows of its latest test without asking the database, as it was given to the database.
/// id 0: there is none.
struct KnownTest {
    TestId id = 0;
    TestRecord record;
    TestState state = TestState::running;
    std::string reason;            ///< of the state
    std::int64_t before_scan = 0;  ///< scans from here on were not given to the database yet
};

/// The one writing connection of a database: WAL, synchronous = FULL. Every call that writes is one
/// transaction and returns after it is on the disk. One thread at a time.
///
/// Errors: `retry` when nothing was written and the same call may succeed later (locked, full, I/O error,
/// read only, a table that another program altered); `refuse_input` when what was given contradicts what is
/// stored; `stop` when the database is damaged. After any error nothing of the call is in the database.
class Store {
  public:
    /// Opens or creates the database, brings an older one to this version, and holds it: a second Store on
    /// the same file, in any process, is refused and told who has it.
    static Result<Store> open(const std::filesystem::path& path, Moment now,
                              const StoreOptions& options = {});

    /// Where the damaged database that was found went, if one was.
    const std::optional<std::filesystem::path>& set_aside() const;

    /// Whether all of the file was looked through for damage when it was opened.
    bool checked() const;

    /// The database turned out to be damaged: it is renamed, and a new one takes its place with the test, of
    /// its scans those that can still be read (the others are missed ones), and what the archive says of the
    /// machines. The test keeps its id. Takes as long as writing the test again. Returns the new name of the
    /// damaged file. After an error all is as it was before; or the damaged file has its new name already:
    /// then nothing is written (`retry`) until a later call has put the new one in place.
    Result<std::filesystem::path> begin_anew(const KnownTest& known, Moment now);

    /// All queries, on this connection.
    const Reader& read() const;

    /// Refused while another test is open. Without an id it gets the next one.
    Result<TestId> begin_test(const TestRecord& test, std::optional<TestId> wanted_id = {});

    /// Acknowledged means on the disk. `scan` is above the last one stored, or fills a hole. The very scan
    /// that is already there (same times and status: a repetition after a doubtful error) is acknowledged
    /// again, not stored twice.
    Result<void> append_scan(TestId id, const ScanRecord& scan);
    /// Several scans, all or none: those kept in memory while the disk was away, or the missed ones after a
    /// restart.
    Result<void> append_scans(TestId id, std::span<const ScanRecord> scans);

    /// The good samples of these channels (positions) in first_scan ... last_scan turn out not to be
    /// readings: they become `stuck` and lose their value, the raw register stays. Returns how many.
    Result<std::int64_t> mark_stuck(TestId id, std::span<const std::size_t> channels, std::int64_t first_scan,
                                    std::int64_t last_scan);

    /// One standing declaration a channel: a second one is refused until the first is withdrawn.
    Result<void> record_declaration(TestId id, const DeclarationRecord& declaration);
    /// The standing declaration of a channel stands no more; it stays in the database with the reason.
    Result<void> withdraw_declaration(TestId id, std::string_view channel, std::string_view reason);
    /// Of all channels of one window at once. The same channel and window again replaces what was said.
    Result<void> record_identifications(TestId id, std::span<const IdentificationRecord> identifications);
    /// Returns the event's id.
    Result<std::int64_t> record_event(const EventRecord& event);
    Result<std::int64_t> record_archive(const ArchiveRecord& archive);

    /// Moves a test on, as TestState allows, and keeps the reason. When it ends, the WAL
    /// is truncated, so that the file alone holds the test.
    Result<void> set_state(TestId id, TestState state, Moment now, std::string_view reason);

    /// The test that was open when the daemon ended, if there was one.
    Result<std::optional<ResumedTest>> resume() const;

    /// A passive checkpoint, for a quiet moment after a scan. Never waits for readers.
    Result<void> checkpoint();
    /// Size of the write-ahead log in bytes: a figure for `health`; a standing reader makes it grow.
    std::uint64_t wal_bytes() const;
    std::uint64_t database_bytes() const;

    Store(Store&&) noexcept;
    Store& operator=(Store&&) noexcept;
    ~Store();

  private:
    struct Parts;
    explicit Store(std::unique_ptr<Parts> parts);
    /// The database that is to follow this one, whole and beside it.
    Result<void> make_successor(const KnownTest& known, Moment now);
    std::unique_ptr<Parts> parts_;
};

}  // namespace thermbal
