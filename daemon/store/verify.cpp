#include <string>
#include <utility>

#include <fmt/format.h>

#include "sqlite.hpp"
#include "store/reader.hpp"

namespace thermbal {

namespace {

using Findings = std::vector<Finding>;

Result<void> check_pages(sqlite::Database& database, Findings& findings) {
    auto rows = database.query("PRAGMA integrity_check(50)");
    while (rows.next())
        if (auto line = rows.text(0); line != "ok")
            findings.push_back({"pages and constraints", std::move(line)});
    // Damage that stops the check itself is what is asked for here, not a failure of asking.
    if (auto status = rows.status(); !status) {
        if (status.error().next != NextStep::stop) return status;
        findings.push_back({"pages and constraints", status.error().message});
    }
    return {};
}

Result<void> check_references(sqlite::Database& database, Findings& findings) {
    auto rows = database.query("PRAGMA foreign_key_check");
    while (rows.next())
        findings.push_back(
            {rows.text(0), fmt::format("a row refers to {}, which is not there", rows.text(2))});
    return rows.status();
}

/// A check that is one query: each row is (test, what is wrong).
struct RowCheck {
    std::string_view sql;
};

constexpr RowCheck row_checks[] = {
    {"SELECT test_id, 'scans ' || (before + 1) || ' to ' || (scan - 1) || ' have no row, not even a missed "
     "one' FROM "
     "(SELECT test_id, scan, lag(scan, 1, -1) OVER (PARTITION BY test_id ORDER BY scan) AS before FROM "
     "scans) "
     "WHERE scan <> before + 1"},
    {"SELECT test_id, 'scan ' || scan || ': time_s ' || time_s || ' is not after the scan before' FROM "
     "(SELECT test_id, scan, time_s, lag(time_s) OVER (PARTITION BY test_id ORDER BY scan) AS before FROM "
     "scans) "
     "WHERE time_s <= before"},
    {"SELECT g.test_id, 'scan ' || g.scan || ': ' || count(s.channel) || ' samples of ' || c.channels || ' "
     "channels' "
     "FROM scans g JOIN (SELECT test_id, count(*) AS channels FROM channels GROUP BY test_id) c USING "
     "(test_id) "
     "LEFT JOIN samples s ON s.test_id = g.test_id AND s.scan = g.scan GROUP BY g.test_id, g.scan "
     "HAVING count(s.channel) <> c.channels"},
    {"SELECT test_id, 'scan ' || scan || ', channel ' || channel || ': quality ' || quality || "
     "iif(value_C IS NULL, ' without a value', ' with a value') FROM samples "
     "WHERE (quality = 'good') <> (value_C IS NOT NULL)"},
    {"SELECT s.test_id, 'scan ' || s.scan || ' was missed, and channel ' || s.channel || ' has a reading' "
     "FROM samples s JOIN scans g USING (test_id, scan) WHERE g.status = 'missed' AND s.quality = 'good'"},
    {"SELECT test_id, 'the declaration of channel ' || channel || ' holds no JSON' FROM declarations "
     "WHERE NOT json_valid(rmse_by_n_C) OR NOT json_valid(basis)"},
    {"SELECT test_id, 'the identification of channel ' || channel || ' at scan ' || window_end_scan || ' "
     "holds no JSON' "
     "FROM identifications WHERE NOT json_valid(verdict)"},
    {"SELECT id, 'ended before it started' FROM tests WHERE ended_monotonic_ns < started_monotonic_ns "
     "AND ended_wall_ns < started_wall_ns"},
};

Result<void> check_rows(sqlite::Database& database, const RowCheck& check, Findings& findings) {
    auto rows = database.query(check.sql);
    while (rows.next()) findings.push_back({fmt::format("test {}", rows.integer(0)), rows.text(1)});
    return rows.status();
}

}  // namespace

Result<bool> Reader::is_sound(std::stop_token stop) const {
    const sqlite::EndsWhenStopped ends(*database_, std::move(stop));
    auto check = database_->query("PRAGMA quick_check(1)");
    const bool sound = check.next() && check.text(0) == "ok";
    if (auto status = check.status(); !status && status.error().next != NextStep::stop)
        return std::unexpected(status.error());
    return sound;
}

Result<std::vector<Finding>> Reader::verify() const {
    sqlite::Transaction snapshot(*database_, sqlite::Transaction::Kind::read);
    if (!snapshot.begun()) return std::unexpected(snapshot.begun().error());
    Findings findings;
    if (auto done = check_pages(*database_, findings); !done) return std::unexpected(done.error());
    // On damaged pages the questions below have no meaning.
    if (!findings.empty()) return findings;
    if (auto done = check_references(*database_, findings); !done) return std::unexpected(done.error());
    for (const auto& check : row_checks)
        if (auto done = check_rows(*database_, check, findings); !done) return std::unexpected(done.error());
    return findings;
}

}  // namespace thermbal
