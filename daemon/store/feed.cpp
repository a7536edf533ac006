#include "store/feed.hpp"

#include <fmt/format.h>

#include "rows.hpp"
#include "sqlite.hpp"

namespace thermbal {

Result<Feed> Feed::open(const std::filesystem::path& path) {
    auto reader = Reader::open(path);
    if (!reader) return std::unexpected(reader.error());
    auto row = reader->database_->query("SELECT database_id FROM identity");
    if (!row.next()) {
        if (auto status = row.status(); !status) return std::unexpected(status.error());
        return fail(NextStep::stop, fmt::format("database {}: has no identity: damaged", path.string()));
    }
    std::string id = row.text(0);
    return Feed(std::move(*reader), std::move(id));
}

Result<std::int64_t> Feed::version() const {
    return reader_.database_->integer("PRAGMA data_version");
}

Result<std::vector<FeedRow<ScanRecord>>> Feed::scans_of(TestId id, std::int64_t first, std::int64_t last,
                                                        const FeedPosition& position) const {
    auto scans = reader_.scans(id, first, last);
    if (!scans) return std::unexpected(scans.error());
    std::vector<FeedRow<ScanRecord>> rows;
    for (ScanRecord& scan : *scans) {
        FeedPosition at = position;
        at.test_id = id;
        at.scan = scan.scan;
        rows.push_back({id, std::move(scan), std::move(at)});
    }
    return rows;
}

Result<std::vector<FeedRow<ScanRecord>>> Feed::scans_after(const FeedPosition& position,
                                                           std::int64_t most) const {
    // The scans of one test at a time: the last number that `most` rows reach, then all of them at once.
    auto next = reader_.database_->query(
        "SELECT test_id, min(scan), max(scan) FROM (SELECT test_id, scan FROM scans WHERE (test_id, scan) > "
        "(?, "
        "?) ORDER BY test_id, scan LIMIT ?) GROUP BY test_id ORDER BY test_id",
        position.test_id, position.scan, most);
    std::vector<FeedRow<ScanRecord>> rows;
    while (next.next()) {
        auto scans = scans_of(next.integer(0), next.integer(1), next.integer(2), position);
        if (!scans) return scans;
        for (auto& scan : *scans) rows.push_back(std::move(scan));
    }
    if (auto status = next.status(); !status) return std::unexpected(status.error());
    return rows;
}

Result<std::vector<FeedRow<ScanRecord>>> Feed::revisions_after(const FeedPosition& position,
                                                               std::int64_t most) const {
    auto next = reader_.database_->query(
        "SELECT id, test_id, scan FROM scan_revisions WHERE id > ? ORDER BY id LIMIT ?", position.revision_id,
        most);
    std::vector<FeedRow<ScanRecord>> rows;
    while (next.next()) {
        auto scans = scans_of(next.integer(1), next.integer(2), next.integer(2), position);
        if (!scans) return scans;
        for (auto& scan : *scans) {
            scan.position = position;
            scan.position.revision_id = next.integer(0);
            rows.push_back(std::move(scan));
        }
    }
    if (auto status = next.status(); !status) return std::unexpected(status.error());
    return rows;
}

Result<std::vector<FeedRow<DeclarationRecord>>> Feed::declarations_after(const FeedPosition& position,
                                                                         std::int64_t most) const {
    auto next = reader_.database_->query(
        fmt::format(
            "SELECT {}, x.id, x.test_id FROM declaration_changes x JOIN declarations d USING (test_id, "
            "channel, window_end_scan) JOIN channels c ON c.test_id = x.test_id AND c.position = "
            "x.channel WHERE x.id > ? ORDER BY x.id LIMIT ?",
            declaration_columns),
        position.declaration_id, most);
    std::vector<FeedRow<DeclarationRecord>> rows;
    while (next.next()) {
        FeedPosition at = position;
        at.declaration_id = next.integer(declaration_column_count);
        rows.push_back({next.integer(declaration_column_count + 1), declaration_in(next), std::move(at)});
    }
    if (auto status = next.status(); !status) return std::unexpected(status.error());
    return rows;
}

Result<std::vector<FeedRow<EventRecord>>> Feed::events_after(const FeedPosition& position,
                                                             std::int64_t most) const {
    auto next = reader_.database_->query(
        fmt::format("SELECT {} FROM events WHERE id > ? ORDER BY id LIMIT ?", event_columns),
        position.event_id, most);
    std::vector<FeedRow<EventRecord>> rows;
    while (next.next()) {
        EventRecord event = event_in(next);
        FeedPosition at = position;
        at.event_id = event.id;
        const TestId test_id = event.test_id.value_or(0);
        rows.push_back({test_id, std::move(event), std::move(at)});
    }
    if (auto status = next.status(); !status) return std::unexpected(status.error());
    return rows;
}

Result<FeedPosition> Feed::before_newest_test() const {
    auto row = reader_.database_->query(
        "SELECT t.id, (SELECT max(id) FROM scan_revisions WHERE test_id < t.id), "
        "(SELECT max(id) FROM declaration_changes WHERE test_id < t.id), "
        "(SELECT max(id) FROM events WHERE test_id < t.id) FROM tests t ORDER BY t.id DESC LIMIT 1");
    FeedPosition position;
    position.database_id = database_id_;
    if (row.next()) {
        position.test_id = row.integer(0);
        position.revision_id = row.optional_integer(1).value_or(0);
        position.declaration_id = row.optional_integer(2).value_or(0);
        position.event_id = row.optional_integer(3).value_or(0);
    }
    if (auto status = row.status(); !status) return std::unexpected(status.error());
    return position;
}

}  // namespace thermbal
