#include "schema.hpp"

#include <array>

#include <fmt/format.h>

namespace thermbal {

namespace {

// Steps are never edited once released: a step that is wrong is mended by the next one.
constexpr const char* version_1 = R"sql(
CREATE TABLE tests (
  id INTEGER PRIMARY KEY,
  name TEXT NOT NULL,
  machine TEXT NOT NULL,
  config_toml TEXT NOT NULL,
  version TEXT NOT NULL,
  period_s REAL NOT NULL CHECK (period_s > 0),
  keep_measuring INTEGER NOT NULL CHECK (keep_measuring IN (0, 1)),
  state TEXT NOT NULL CHECK (state IN ('running', 'declared', 'stopped', 'aborted')),
  started_wall_ns INTEGER NOT NULL,
  started_monotonic_ns INTEGER NOT NULL,
  boot_id TEXT NOT NULL,
  ended_wall_ns INTEGER,
  ended_monotonic_ns INTEGER,
  stop_reason TEXT NOT NULL DEFAULT '',
  CHECK ((state IN ('running', 'declared')) = (ended_wall_ns IS NULL)),
  CHECK ((ended_wall_ns IS NULL) = (ended_monotonic_ns IS NULL))
) STRICT;
CREATE UNIQUE INDEX one_open_test ON tests ((1)) WHERE state IN ('running', 'declared');

CREATE TABLE channels (
  test_id INTEGER NOT NULL REFERENCES tests,
  position INTEGER NOT NULL CHECK (position >= 0),
  name TEXT NOT NULL CHECK (name <> ''),
  role TEXT NOT NULL,
  place TEXT NOT NULL,
  required INTEGER NOT NULL CHECK (required IN (0, 1)),
  source TEXT NOT NULL,
  PRIMARY KEY (test_id, position),
  UNIQUE (test_id, name)
) STRICT, WITHOUT ROWID;

CREATE TABLE scans (
  test_id INTEGER NOT NULL REFERENCES tests,
  scan INTEGER NOT NULL CHECK (scan >= 0),
  status TEXT NOT NULL CHECK (status IN ('ok', 'late', 'repeated', 'missed')),
  time_s REAL NOT NULL,
  scheduled_ns INTEGER NOT NULL,
  started_ns INTEGER,
  finished_ns INTEGER,
  wall_ns INTEGER NOT NULL,
  PRIMARY KEY (test_id, scan),
  CHECK (status <> 'missed' OR (started_ns IS NULL AND finished_ns IS NULL))
) STRICT, WITHOUT ROWID;

CREATE TABLE samples (
  test_id INTEGER NOT NULL,
  scan INTEGER NOT NULL,
  channel INTEGER NOT NULL,
  raw INTEGER CHECK (raw BETWEEN 0 AND 4294967295),
  value_C REAL CHECK (abs(value_C) < 1e300),
  quality TEXT NOT NULL CHECK (quality IN ('good', 'open', 'short', 'over_range', 'under_range', 'stuck',
                                           'stale', 'communication', 'gap')),
  PRIMARY KEY (test_id, scan, channel),
  FOREIGN KEY (test_id, scan) REFERENCES scans,
  FOREIGN KEY (test_id, channel) REFERENCES channels,
  CHECK ((quality = 'good') = (value_C IS NOT NULL))
) STRICT, WITHOUT ROWID;

CREATE TABLE inputs (
  test_id INTEGER NOT NULL,
  scan INTEGER NOT NULL,
  name TEXT NOT NULL CHECK (name <> ''),
  value REAL,
  PRIMARY KEY (test_id, scan, name),
  FOREIGN KEY (test_id, scan) REFERENCES scans
) STRICT, WITHOUT ROWID;

CREATE TABLE declarations (
  test_id INTEGER NOT NULL,
  channel INTEGER NOT NULL,
  window_end_scan INTEGER NOT NULL,
  declared_at_min REAL NOT NULL,
  n INTEGER NOT NULL,
  C REAL,
  sigma REAL,
  steady_state_C REAL,
  steady_state_low_C REAL,
  steady_state_high_C REAL,
  equilibrium_time_min REAL,
  rmse_by_n_C TEXT NOT NULL,
  basis TEXT NOT NULL,
  version TEXT NOT NULL,
  PRIMARY KEY (test_id, channel),
  FOREIGN KEY (test_id, channel) REFERENCES channels,
  FOREIGN KEY (test_id, window_end_scan) REFERENCES scans
) STRICT;

CREATE TABLE identifications (
  test_id INTEGER NOT NULL,
  channel INTEGER NOT NULL,
  window_end_scan INTEGER NOT NULL,
  wall_ns INTEGER NOT NULL,
  verdict TEXT NOT NULL,
  PRIMARY KEY (test_id, channel, window_end_scan),
  FOREIGN KEY (test_id, channel) REFERENCES channels,
  FOREIGN KEY (test_id, window_end_scan) REFERENCES scans
) STRICT;

CREATE TABLE events (
  id INTEGER PRIMARY KEY,
  test_id INTEGER REFERENCES tests,
  wall_ns INTEGER NOT NULL,
  time_s REAL,
  kind TEXT NOT NULL CHECK (kind <> ''),
  channel TEXT,
  message TEXT NOT NULL
) STRICT;
CREATE INDEX events_of_a_test ON events (test_id, id);

CREATE VIEW readings AS
  SELECT s.test_id, s.scan, g.time_s, g.wall_ns, c.name AS channel, s.raw, s.value_C, s.quality
  FROM samples s JOIN scans g USING (test_id, scan)
  JOIN channels c ON c.test_id = s.test_id AND c.position = s.channel;
)sql";

// What earlier tests taught, for the priors of the next one.
constexpr const char* version_2 = R"sql(
CREATE TABLE archive (
  id INTEGER PRIMARY KEY,
  machine TEXT NOT NULL,
  test_id INTEGER REFERENCES tests,
  created_wall_ns INTEGER NOT NULL,
  spectrum TEXT NOT NULL
) STRICT;
CREATE INDEX archive_of_a_machine ON archive (machine, id);
)sql";

// A declaration that later samples contradict is withdrawn, kept, and may be followed by another one.
constexpr const char* version_3 = R"sql(
CREATE TABLE declarations_3 (
  test_id INTEGER NOT NULL,
  channel INTEGER NOT NULL,
  window_end_scan INTEGER NOT NULL,
  declared_at_min REAL NOT NULL,
  n INTEGER NOT NULL,
  C REAL,
  sigma REAL,
  steady_state_C REAL,
  steady_state_low_C REAL,
  steady_state_high_C REAL,
  equilibrium_time_min REAL,
  rmse_by_n_C TEXT NOT NULL,
  basis TEXT NOT NULL,
  version TEXT NOT NULL,
  withdrawn TEXT NOT NULL DEFAULT '',
  PRIMARY KEY (test_id, channel, window_end_scan),
  FOREIGN KEY (test_id, channel) REFERENCES channels,
  FOREIGN KEY (test_id, window_end_scan) REFERENCES scans
) STRICT;
INSERT INTO declarations_3 SELECT *, '' FROM declarations;
DROP TABLE declarations;
ALTER TABLE declarations_3 RENAME TO declarations;
CREATE UNIQUE INDEX one_standing_declaration ON declarations (test_id, channel) WHERE withdrawn = '';
)sql";

// What the module said stands beside what a calibration made of it, and what the calibration was.
constexpr const char* version_4 = R"sql(
ALTER TABLE samples ADD COLUMN source_C REAL CHECK (abs(source_C) < 1e300);
ALTER TABLE channels ADD COLUMN calibration TEXT NOT NULL DEFAULT '';
DROP VIEW readings;
CREATE VIEW readings AS
  SELECT s.test_id, s.scan, g.time_s, g.wall_ns, c.name AS channel, s.raw, s.source_C, s.value_C, s.quality
  FROM samples s JOIN scans g USING (test_id, scan)
  JOIN channels c ON c.test_id = s.test_id AND c.position = s.channel;
)sql";

// What another program sends on (feed.hpp) and what people plot. Nothing is removed from a database, so a
// position in it says what has been sent; what changes behind that position gets a row here: a hole that is
// filled, readings that turn out to be stuck, a declaration that is withdrawn.
constexpr const char* version_5 = R"sql(
CREATE TABLE identity (database_id TEXT NOT NULL) STRICT;
INSERT INTO identity VALUES (lower(hex(randomblob(16))));

CREATE TABLE scan_revisions (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  test_id INTEGER NOT NULL,
  scan INTEGER NOT NULL,
  UNIQUE (test_id, scan),
  FOREIGN KEY (test_id, scan) REFERENCES scans
) STRICT;
CREATE TRIGGER scan_fills_a_hole AFTER INSERT ON scans
  WHEN EXISTS (SELECT 1 FROM scans WHERE test_id = NEW.test_id AND scan > NEW.scan) BEGIN
  DELETE FROM scan_revisions WHERE test_id = NEW.test_id AND scan = NEW.scan;
  INSERT INTO scan_revisions (test_id, scan) VALUES (NEW.test_id, NEW.scan);
END;
CREATE TRIGGER sample_revised AFTER UPDATE ON samples BEGIN
  DELETE FROM scan_revisions WHERE test_id = NEW.test_id AND scan = NEW.scan;
  INSERT INTO scan_revisions (test_id, scan) VALUES (NEW.test_id, NEW.scan);
END;

CREATE TABLE declaration_changes (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  test_id INTEGER NOT NULL,
  channel INTEGER NOT NULL,
  window_end_scan INTEGER NOT NULL,
  FOREIGN KEY (test_id, channel, window_end_scan) REFERENCES declarations
) STRICT;
CREATE TRIGGER declaration_made AFTER INSERT ON declarations BEGIN
  INSERT INTO declaration_changes (test_id, channel, window_end_scan)
  VALUES (NEW.test_id, NEW.channel, NEW.window_end_scan);
END;
CREATE TRIGGER declaration_withdrawn AFTER UPDATE OF withdrawn ON declarations BEGIN
  INSERT INTO declaration_changes (test_id, channel, window_end_scan)
  VALUES (NEW.test_id, NEW.channel, NEW.window_end_scan);
END;
INSERT INTO declaration_changes (test_id, channel, window_end_scan)
  SELECT test_id, channel, window_end_scan FROM declarations ORDER BY test_id, window_end_scan, channel;

CREATE VIEW test_overview AS
  SELECT t.id AS test_id, t.name AS test, t.machine, t.state, t.stop_reason, t.period_s, t.version,
         t.started_wall_ns / 1e9 AS started_epoch_s,
         strftime('%Y-%m-%dT%H:%M:%fZ', t.started_wall_ns / 1e9, 'unixepoch') AS started_iso,
         t.ended_wall_ns / 1e9 AS ended_epoch_s,
         strftime('%Y-%m-%dT%H:%M:%fZ', t.ended_wall_ns / 1e9, 'unixepoch') AS ended_iso,
         (SELECT max(scan) + 1 FROM scans WHERE test_id = t.id) AS scans,
         (SELECT count(*) FROM channels WHERE test_id = t.id) AS channels,
         (SELECT count(*) FROM declarations WHERE test_id = t.id AND withdrawn = '') AS declared_channels
  FROM tests t;
CREATE VIEW temperature AS
  SELECT s.test_id, t.name AS test, t.machine, c.name AS channel, c.place, c.role, s.scan,
         g.wall_ns / 1e9 AS time_epoch_s,
         strftime('%Y-%m-%dT%H:%M:%fZ', g.wall_ns / 1e9, 'unixepoch') AS time_iso,
         g.time_s, s.value_C, s.quality
  FROM samples s JOIN scans g USING (test_id, scan)
  JOIN channels c ON c.test_id = s.test_id AND c.position = s.channel
  JOIN tests t ON t.id = s.test_id;
CREATE VIEW known_input AS
  SELECT i.test_id, t.name AS test, t.machine, i.name AS input, i.scan, g.wall_ns / 1e9 AS time_epoch_s,
         strftime('%Y-%m-%dT%H:%M:%fZ', g.wall_ns / 1e9, 'unixepoch') AS time_iso, g.time_s, i.value
  FROM inputs i JOIN scans g USING (test_id, scan) JOIN tests t ON t.id = i.test_id;
CREATE VIEW declared_steady_state AS
  SELECT d.test_id, t.name AS test, t.machine, c.name AS channel, c.place, c.role,
         g.wall_ns / 1e9 AS time_epoch_s,
         strftime('%Y-%m-%dT%H:%M:%fZ', g.wall_ns / 1e9, 'unixepoch') AS time_iso,
         d.declared_at_min, d.n, d.steady_state_C, d.steady_state_low_C, d.steady_state_high_C,
         d.equilibrium_time_min, d.withdrawn = '' AS stands, d.withdrawn
  FROM declarations d JOIN tests t ON t.id = d.test_id
  JOIN scans g ON g.test_id = d.test_id AND g.scan = d.window_end_scan
  JOIN channels c ON c.test_id = d.test_id AND c.position = d.channel;
CREATE VIEW data_quality AS
  SELECT s.test_id, t.name AS test, t.machine, c.name AS channel, c.place, s.quality, count(*) AS samples
  FROM samples s JOIN channels c ON c.test_id = s.test_id AND c.position = s.channel
  JOIN tests t ON t.id = s.test_id GROUP BY s.test_id, s.channel, s.quality;
CREATE VIEW event_log AS
  SELECT e.id, e.test_id, t.name AS test, t.machine, e.wall_ns / 1e9 AS time_epoch_s,
         strftime('%Y-%m-%dT%H:%M:%fZ', e.wall_ns / 1e9, 'unixepoch') AS time_iso, e.time_s, e.kind, e.channel,
         e.message
  FROM events e LEFT JOIN tests t ON t.id = e.test_id;
)sql";

// The simulation that a test is compared with, as it was given.
constexpr const char* version_6 = R"sql(
ALTER TABLE tests ADD COLUMN model_toml TEXT NOT NULL DEFAULT '';
ALTER TABLE tests ADD COLUMN model_file TEXT NOT NULL DEFAULT '';
)sql";

constexpr std::array steps = {version_1, version_2, version_3, version_4, version_5, version_6};

}  // namespace

int schema_version() {
    return static_cast<int>(steps.size());
}

Result<void> check_schema(sqlite::Database& database, bool may_migrate) {
    const auto version = database.integer("PRAGMA user_version");
    if (!version) return std::unexpected(version.error());
    const auto id = database.integer("PRAGMA application_id");
    if (!id) return std::unexpected(id.error());
    const auto tables = database.integer("SELECT count(*) FROM sqlite_schema");
    if (!tables) return std::unexpected(tables.error());

    const bool empty = *tables == 0 && *version == 0;
    if (empty && may_migrate) return {};
    if (*id != application_id)
        return fail(NextStep::refuse_input,
                    fmt::format("database {}: not a database of thermbald; name another file",
                                database.path().string()));
    if (*version > schema_version())
        return fail(
            NextStep::refuse_input,
            fmt::format(
                "database {}: schema version {}, this program knows up to {}; use the newer thermbald "
                "that wrote it, or name another file",
                database.path().string(), *version, schema_version()));
    if (*version < schema_version() && !may_migrate)
        return fail(
            NextStep::refuse_input,
            fmt::format("database {}: schema version {}, this program reads {}; start thermbald on it once, "
                        "which brings it up to date",
                        database.path().string(), *version, schema_version()));
    return {};
}

Result<void> migrate(sqlite::Database& database) {
    sqlite::Transaction transaction(database, sqlite::Transaction::Kind::write);
    if (!transaction.begun()) return transaction.begun();
    const auto version = database.integer("PRAGMA user_version");
    if (!version) return std::unexpected(version.error());
    if (*version == schema_version()) return {};
    for (auto step = static_cast<std::size_t>(*version); step < steps.size(); ++step)
        if (auto done = database.execute(steps[step]); !done) return done;
    if (auto stamped = database.execute(fmt::format("PRAGMA user_version = {}; PRAGMA application_id = {}",
                                                    schema_version(), application_id));
        !stamped)
        return stamped;
    return transaction.commit();
}

}  // namespace thermbal
