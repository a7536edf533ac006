#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "store/reader.hpp"
#include "store/records.hpp"

namespace thermbal {

/// How far a database has been sent on: everything up to here, in each of its four lists. Means something
/// only for the database that `database_id` names.
struct FeedPosition {
    std::string database_id;
    TestId test_id = 0;               ///< of the newest scan that was sent
    std::int64_t scan = -1;           ///< the newest scan of that test that was sent
    std::int64_t revision_id = 0;     ///< of scans that changed after they were stored
    std::int64_t declaration_id = 0;  ///< of declarations made and withdrawn
    std::int64_t event_id = 0;

    bool operator==(const FeedPosition&) const = default;
};

/// One row of a list, and the position of everything up to it. `position` changes in one field only.
template <typename Record>
struct FeedRow {
    TestId test_id = 0;  ///< 0: of no test
    Record record;
    FeedPosition position;
};

/// A database as lists that only grow, oldest first, for a program that sends it on. Read only; the daemon
/// never waits for it. One thread at a time. Errors as Reader.
///
/// A scan that fills a hole, or whose readings turn out to be stuck, comes (again) in `revisions_after`; a
/// declaration that is withdrawn comes again in `declarations_after`. So whoever sends everything after a
/// position, and keeps the position, has sent everything.
class Feed {
  public:
    static Result<Feed> open(const std::filesystem::path& path);

    const std::string& database_id() const { return database_id_; }
    /// Another number than before when something was committed since.
    Result<std::int64_t> version() const;

    Result<std::vector<FeedRow<ScanRecord>>> scans_after(const FeedPosition& position,
                                                         std::int64_t most) const;
    Result<std::vector<FeedRow<ScanRecord>>> revisions_after(const FeedPosition& position,
                                                             std::int64_t most) const;
    Result<std::vector<FeedRow<DeclarationRecord>>> declarations_after(const FeedPosition& position,
                                                                       std::int64_t most) const;
    Result<std::vector<FeedRow<EventRecord>>> events_after(const FeedPosition& position,
                                                           std::int64_t most) const;

    /// Before the first scan of the newest test: for a first start on a database with old tests. Events and
    /// declarations of older tests count as sent.
    Result<FeedPosition> before_newest_test() const;

    const Reader& read() const { return reader_; }

  private:
    Feed(Reader reader, std::string database_id)
        : reader_(std::move(reader)), database_id_(std::move(database_id)) {}
    Result<std::vector<FeedRow<ScanRecord>>> scans_of(TestId id, std::int64_t first, std::int64_t last,
                                                      const FeedPosition& position) const;

    Reader reader_;
    std::string database_id_;
};

}  // namespace thermbal
