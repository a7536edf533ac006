#include "store/store.hpp"

#include <cmath>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "database_file.hpp"
#include "salvage.hpp"
#include "schema.hpp"
#include "sqlite.hpp"

namespace thermbal {

struct Store::Parts {
    WriterLock lock;
    Reader reader;
    std::optional<std::filesystem::path> set_aside;
    int busy_timeout_ms;
    bool checked;
    /// The damaged file has its new name, this connection still writes it, and the new one is not opened yet:
    /// what would be written now would be lost.
    std::optional<Error> unfinished_move = {};

    sqlite::Database& database() const { return *reader.database_; }
};

namespace {

using sqlite::Transaction;

constexpr std::string_view insert_scan_sql =
    "INSERT INTO scans (test_id, scan, status, time_s, scheduled_ns, started_ns, finished_ns, wall_ns) "
    "VALUES (?, ?, ?, ?, ?, ?, ?, ?)";
constexpr std::string_view insert_sample_sql =
    "INSERT INTO samples (test_id, scan, channel, raw, value_C, quality, source_C) VALUES (?, ?, ?, ?, ?, ?, "
    "?)";
constexpr std::string_view insert_input_sql =
    "INSERT INTO inputs (test_id, scan, name, value) VALUES (?, ?, ?, ?)";

/// Begins, calls `body`, commits: all or nothing.
template <typename Parts, typename Body>
Result<void> in_transaction(const Parts& parts, const Body& body) {
    if (parts.unfinished_move) return std::unexpected(*parts.unfinished_move);
    Transaction transaction(parts.database(), Transaction::Kind::write);
    if (!transaction.begun()) return transaction.begun();
    if (Result<void> done = body(); !done) return done;
    return transaction.commit();
}

Result<std::shared_ptr<sqlite::Database>> open_writing(const std::filesystem::path& path,
                                                       int busy_timeout_ms) {
    auto database = sqlite::Database::open(path, sqlite::OpenMode::read_write, busy_timeout_ms);
    if (!database) return database;
    if (auto ours = check_schema(**database, true); !ours) return std::unexpected(ours.error());
    // FULL syncs the WAL at every commit: acknowledged is on the disk. The checkpoint after 1000 pages is
    // only for a caller that forgets checkpoint().
    if (auto set = (*database)->execute(
            "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA wal_autocheckpoint = 1000");
        !set)
        return std::unexpected(set.error());
    auto mode = (*database)->query("PRAGMA journal_mode");
    if (!mode.next() || mode.text(0) != "wal")
        return fail(
            NextStep::refuse_input,
            fmt::format("database {}: its file system cannot hold a write-ahead log; put it on a local disk",
                        path.string()));
    (*database)->keep_wal_file();
    return database;
}

/// Where the database that is to follow a damaged one is made.
std::filesystem::path beside(const std::filesystem::path& path) {
    return path.string() + ".new";
}

Result<std::optional<std::filesystem::path>> clear_damage(const std::filesystem::path& path, Moment now,
                                                          const StoreOptions& options, bool all) {
    auto damaged = is_damaged(path, options.busy_timeout_ms, all);
    if (!damaged) return std::unexpected(damaged.error());
    if (!*damaged) return std::optional<std::filesystem::path>{};
    if (!options.set_aside_damaged)
        return fail(NextStep::stop,
                    fmt::format("database {}: damaged; move it away, and try `sqlite3 FILE .recover`",
                                path.string()));
    return put_aside(path, now);
}

Result<std::shared_ptr<sqlite::Database>> take_place(const std::filesystem::path& fresh,
                                                     const std::filesystem::path& path, int busy_timeout_ms) {
    if (auto moved = put_in_place_if_due(fresh, path); !moved) return std::unexpected(moved.error());
    return open_writing(path, busy_timeout_ms);
}

/// What is on disk of the test a scan is for.
struct ScanContext {
    TestId id = 0;
    std::size_t channels = 0;
    std::int64_t last_scan = -1;
    double last_time_s = -INFINITY;
};

Result<ScanContext> context_of(sqlite::Database& database, TestId id) {
    ScanContext context;
    context.id = id;
    auto test = database.query(
        "SELECT state, (SELECT count(*) FROM channels WHERE test_id = tests.id) FROM tests WHERE id = ?", id);
    if (!test.next()) {
        if (auto status = test.status(); !status) return std::unexpected(status.error());
        return fail(NextStep::refuse_input, fmt::format("there is no test {}", id));
    }
    if (const auto state = test.text(0); state != "running" && state != "declared")
        return fail(NextStep::refuse_input, fmt::format("test {} is {}: it takes no more scans", id, state));
    context.channels = static_cast<std::size_t>(test.integer(1));
    auto last =
        database.query("SELECT scan, time_s FROM scans WHERE test_id = ? ORDER BY scan DESC LIMIT 1", id);
    if (last.next()) {
        context.last_scan = last.integer(0);
        context.last_time_s = last.real(1);
    }
    if (auto status = last.status(); !status) return std::unexpected(status.error());
    return context;
}

Result<void> check_scan(const ScanContext& context, const ScanRecord& scan) {
    const auto refuse = [&](const std::string& what) {
        return fail(NextStep::refuse_input, fmt::format("test {}, scan {}: {}", context.id, scan.scan, what));
    };
    const bool all_gaps = scan.status == ScanStatus::missed && scan.samples.empty();
    if (!all_gaps && scan.samples.size() != context.channels)
        return refuse(fmt::format("{} samples for {} channels", scan.samples.size(), context.channels));
    for (const auto& sample : scan.samples) {
        if (sample.quality == Quality::good && !sample.good()) return refuse("a good sample without a value");
        if (sample.quality == Quality::good && scan.status == ScanStatus::missed)
            return refuse("a missed scan with a reading");
    }
    return {};
}

/// A scan comes behind the last one, or fills a hole that an earlier refusal left.
Result<void> check_place(sqlite::Database& database, const ScanContext& context, const ScanRecord& scan) {
    const auto refuse = [&](const std::string& what) {
        return fail(NextStep::refuse_input, fmt::format("test {}, scan {}: {}", context.id, scan.scan, what));
    };
    const auto not_after = [&](double before_s) {
        return refuse(fmt::format("time_s {} is not after {} of the scan before", scan.time_s, before_s));
    };
    if (scan.scan > context.last_scan)
        return scan.time_s > context.last_time_s ? Result<void>() : not_after(context.last_time_s);
    auto around = database.query(
        "SELECT (SELECT count(*) FROM scans WHERE test_id = ?1 AND scan = ?2), "
        "(SELECT time_s FROM scans WHERE test_id = ?1 AND scan < ?2 ORDER BY scan DESC LIMIT 1), "
        "(SELECT time_s FROM scans WHERE test_id = ?1 AND scan > ?2 ORDER BY scan LIMIT 1)",
        context.id, scan.scan);
    if (around.next()) {
        if (around.integer(0) != 0) return refuse("is stored already, with another content");
        if (!around.null(1) && !(scan.time_s > around.real(1))) return not_after(around.real(1));
        if (!around.null(2) && !(scan.time_s < around.real(2)))
            return refuse(
                fmt::format("time_s {} is not before {} of the scan after", scan.time_s, around.real(2)));
    }
    return around.status();
}

Result<bool> is_stored(sqlite::Database& database, TestId id, const ScanRecord& scan) {
    auto row = database.query(
        "SELECT count(*) FROM scans WHERE test_id = ? AND scan = ? AND status = ? AND time_s = ? AND "
        "scheduled_ns = ? "
        "AND started_ns IS ? AND finished_ns IS ? AND wall_ns = ?",
        id, scan.scan, to_string(scan.status), scan.time_s, scan.scheduled_ns, scan.started_ns,
        scan.finished_ns, scan.wall_ns);
    const bool there = row.next() && row.integer(0) == 1;
    if (auto status = row.status(); !status) return std::unexpected(status.error());
    return there;
}

Result<void> insert_scan(sqlite::Database& database, const ScanContext& context, const ScanRecord& scan) {
    if (auto done = database.run(insert_scan_sql, context.id, scan.scan, to_string(scan.status), scan.time_s,
                                 scan.scheduled_ns, scan.started_ns, scan.finished_ns, scan.wall_ns);
        !done)
        return done;
    auto insert_sample = database.query(insert_sample_sql);
    for (std::size_t channel = 0; channel < context.channels; ++channel) {
        const Sample sample = scan.samples.empty() ? Sample{} : scan.samples[channel];
        const std::optional<std::int64_t> raw = sample.raw;
        const double value_C = sample.good() ? sample.value_C : no_value;
        if (auto done = insert_sample
                            .bind(context.id, scan.scan, static_cast<std::int64_t>(channel), raw, value_C,
                                  to_string(sample.quality), sample.source_C)
                            .run();
            !done)
            return done;
    }
    auto insert_input = database.query(insert_input_sql);
    for (const auto& input : scan.inputs)
        if (auto done = insert_input.bind(context.id, scan.scan, input.name, input.value).run(); !done)
            return done;
    return {};
}

Result<std::int64_t> channel_position(sqlite::Database& database, TestId id, const std::string& channel) {
    auto row = database.query("SELECT position FROM channels WHERE test_id = ? AND name = ?", id, channel);
    if (row.next()) return row.integer(0);
    if (auto status = row.status(); !status) return std::unexpected(status.error());
    return fail(NextStep::refuse_input, fmt::format("test {} has no channel {}", id, channel));
}

std::string curve_json(const std::vector<double>& curve) {
    // NaN becomes null; every other double is written with the digits that read back to it.
    return nlohmann::json(curve).dump();
}

/// Checked here and not by the schema: SQLite's JSON functions are not trusted in one.
Result<void> check_json(std::string_view what, const std::string& text) {
    if (nlohmann::json::accept(text)) return {};
    return fail(NextStep::refuse_input, fmt::format("{}: not JSON: {:.60}", what, text));
}

bool may_follow(TestState from, TestState to) {
    switch (from) {
        case TestState::running:
            return to != TestState::running;
        case TestState::declared:
            return to == TestState::stopped || to == TestState::aborted;
        case TestState::idle:
        case TestState::stopped:
        case TestState::aborted:
            return false;
    }
    return false;
}

/// Empties the log into the file, unless a reader holds it: that is not worth waiting for.
void fold_wal(sqlite::Database& database) {
    database.set_busy_timeout_ms(100);
    (void)database.execute("PRAGMA wal_checkpoint(TRUNCATE)");
}

std::uint64_t size_of(const std::filesystem::path& path) {
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    return error ? 0 : size;
}

}  // namespace

Store::Store(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Store::Store(Store&&) noexcept = default;
Store& Store::operator=(Store&&) noexcept = default;

Store::~Store() {
    // The log is kept for readers (keep_wal_file): leave it empty. What cannot be folded in now, the next
    // open does.
    if (parts_ && !parts_->unfinished_move) fold_wal(parts_->database());
}

Result<Store> Store::open(const std::filesystem::path& path, Moment now, const StoreOptions& options) {
    auto lock = WriterLock::take(path);
    if (!lock) return std::unexpected(lock.error());
    if (auto done = finish_put_aside(path); !done) return std::unexpected(done.error());
    const bool check_all = size_of(path) <= options.checked_at_once_bytes;
    auto set_aside = clear_damage(path, now, options, check_all);
    if (!set_aside) return std::unexpected(set_aside.error());
    if (auto done = put_in_place_if_due(beside(path), path); !done) return std::unexpected(done.error());
    if (auto created = create_if_absent(path); !created) return std::unexpected(created.error());
    auto database = open_writing(path, options.busy_timeout_ms);
    if (!database) return std::unexpected(database.error());
    if (auto migrated = migrate(**database); !migrated) return std::unexpected(migrated.error());
    return Store(
        std::unique_ptr<Parts>(new Parts{std::move(*lock), Reader(std::move(*database)),
                                         std::move(*set_aside), options.busy_timeout_ms, check_all}));
}

bool Store::checked() const {
    return parts_->checked;
}

Result<void> Store::make_successor(const KnownTest& known, Moment now) {
    const std::filesystem::path fresh_path = beside(parts_->database().path());
    remove_database(fresh_path);
    {
        auto fresh = Store::open(fresh_path, now, {.busy_timeout_ms = parts_->busy_timeout_ms});
        if (!fresh) return std::unexpected(fresh.error());
        if (auto salvaged = salvage(read(), *fresh, known, now); !salvaged) return salvaged;
    }
    if (size_of(fresh_path.string() + "-wal") > 0)
        return fail(NextStep::retry,
                    fmt::format("database {}: its log could not be folded in", fresh_path.string()));
    return {};
}

Result<std::filesystem::path> Store::begin_anew(const KnownTest& known, Moment now) {
    const std::filesystem::path path = parts_->database().path();
    if (!parts_->unfinished_move) {
        // Beside the damaged one until it is whole: a full disk or the end of the process changes nothing.
        if (auto made = make_successor(known, now); !made) return std::unexpected(made.error());
        parts_->database().leave_wal_alone_on_close();
        auto aside = put_aside(path, now);
        if (!aside) {
            // The old one goes on: what is new now would be behind it at the next start.
            remove_database(beside(path));
            return aside;
        }
        parts_->set_aside = *aside;
    }
    auto database = take_place(beside(path), path, parts_->busy_timeout_ms);
    if (!database) {
        parts_->unfinished_move = {
            NextStep::retry,
            fmt::format(
                "database {}: the damaged one is set aside as {}, and the new one cannot be opened: {}",
                path.string(), parts_->set_aside->string(), database.error().message)};
        return std::unexpected(*parts_->unfinished_move);
    }
    parts_->reader = Reader(std::move(*database));
    parts_->unfinished_move.reset();
    return *parts_->set_aside;
}

const std::optional<std::filesystem::path>& Store::set_aside() const {
    return parts_->set_aside;
}

const Reader& Store::read() const {
    return parts_->reader;
}

Result<TestId> Store::begin_test(const TestRecord& test, std::optional<TestId> wanted_id) {
    auto& database = parts_->database();
    auto open_test = read().open_test();
    if (!open_test) return std::unexpected(open_test.error());
    if (*open_test)
        return fail(NextStep::refuse_input,
                    fmt::format("test {} ({}) is still {}; stop it first", (*open_test)->id,
                                (*open_test)->record.name, to_string((*open_test)->state)));
    TestId id = 0;
    auto done = in_transaction(*parts_, [&]() -> Result<void> {
        if (auto inserted =
                database.run("INSERT INTO tests (id, name, machine, config_toml, version, "
                             "period_s, keep_measuring, state, "
                             "started_wall_ns, started_monotonic_ns, boot_id, "
                             "model_toml, model_file) VALUES (?, ?, ?, "
                             "?, ?, ?, ?, 'running', ?, ?, ?, ?, ?)",
                             wanted_id, test.name, test.machine, test.config_toml, test.version,
                             test.period_s, test.keep_measuring, test.started.wall_ns,
                             test.started.monotonic_ns, test.boot_id, test.model_toml, test.model_file);
            !inserted)
            return inserted;
        id = database.last_insert_id();
        auto insert = database.query(
            "INSERT INTO channels (test_id, position, name, role, place, required, source, calibration) "
            "VALUES "
            "(?, ?, ?, ?, ?, ?, ?, ?)");
        std::int64_t position = 0;
        for (const auto& channel : test.channels)
            if (auto inserted = insert
                                    .bind(id, position++, channel.name, channel.role, channel.place,
                                          channel.required, channel.source, channel.calibration)
                                    .run();
                !inserted)
                return inserted;
        return {};
    });
    if (!done) return std::unexpected(done.error());
    return id;
}

Result<void> Store::append_scan(TestId id, const ScanRecord& scan) {
    return append_scans(id, std::span(&scan, 1));
}

Result<void> Store::append_scans(TestId id, std::span<const ScanRecord> scans) {
    auto& database = parts_->database();
    return in_transaction(*parts_, [&]() -> Result<void> {
        auto context = context_of(database, id);
        if (!context) return std::unexpected(context.error());
        for (const auto& scan : scans) {
            if (scan.scan <= context->last_scan) {
                const auto stored = is_stored(database, id, scan);
                if (!stored) return std::unexpected(stored.error());
                if (*stored) continue;
            }
            if (auto sound = check_scan(*context, scan); !sound) return sound;
            if (auto fits = check_place(database, *context, scan); !fits) return fits;
            if (auto inserted = insert_scan(database, *context, scan); !inserted) return inserted;
            if (scan.scan < context->last_scan) continue;
            context->last_scan = scan.scan;
            context->last_time_s = scan.time_s;
        }
        return {};
    });
}

Result<std::int64_t> Store::mark_stuck(TestId id, std::span<const std::size_t> channels,
                                       std::int64_t first_scan, std::int64_t last_scan) {
    auto& database = parts_->database();
    std::int64_t marked = 0;
    auto done = in_transaction(*parts_, [&]() -> Result<void> {
        auto update = database.query(
            "UPDATE samples SET quality = 'stuck', value_C = NULL, source_C = NULL WHERE test_id = ? AND "
            "channel = ? "
            "AND scan BETWEEN ? AND ? AND quality = 'good'");
        for (const std::size_t channel : channels) {
            if (auto run = update.bind(id, static_cast<std::int64_t>(channel), first_scan, last_scan).run();
                !run)
                return run;
            marked += database.changes();
        }
        return {};
    });
    if (!done) return std::unexpected(done.error());
    return marked;
}

Result<void> Store::record_declaration(TestId id, const DeclarationRecord& declaration) {
    auto& database = parts_->database();
    return in_transaction(*parts_, [&]() -> Result<void> {
        if (auto valid = check_json("declaration", declaration.basis_json); !valid) return valid;
        const auto channel = channel_position(database, id, declaration.channel);
        if (!channel) return std::unexpected(channel.error());
        return database.run(
            "INSERT INTO declarations (test_id, channel, window_end_scan, declared_at_min, n, C, sigma, "
            "steady_state_C, steady_state_low_C, steady_state_high_C, equilibrium_time_min, rmse_by_n_C, "
            "basis, "
            "version) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            id, *channel, declaration.window_end_scan, declaration.declared_at_min, declaration.n,
            declaration.C, declaration.sigma, declaration.steady_state_C, declaration.steady_state_low_C,
            declaration.steady_state_high_C, declaration.equilibrium_time_min,
            curve_json(declaration.rmse_by_n_C), declaration.basis_json, declaration.version);
    });
}

Result<void> Store::withdraw_declaration(TestId id, std::string_view channel, std::string_view reason) {
    auto& database = parts_->database();
    return in_transaction(*parts_, [&]() -> Result<void> {
        const auto position = channel_position(database, id, std::string(channel));
        if (!position) return std::unexpected(position.error());
        return database.run(
            "UPDATE declarations SET withdrawn = ? WHERE test_id = ? AND channel = ? AND withdrawn = ''",
            reason, id, *position);
    });
}

Result<void> Store::record_identifications(TestId id, std::span<const IdentificationRecord> identifications) {
    auto& database = parts_->database();
    return in_transaction(*parts_, [&]() -> Result<void> {
        for (const auto& identification : identifications) {
            if (auto valid = check_json("identification", identification.verdict_json); !valid) return valid;
            const auto channel = channel_position(database, id, identification.channel);
            if (!channel) return std::unexpected(channel.error());
            if (auto done = database.run("INSERT OR REPLACE INTO identifications (test_id, channel, "
                                         "window_end_scan, wall_ns, verdict) "
                                         "VALUES (?, ?, ?, ?, ?)",
                                         id, *channel, identification.window_end_scan, identification.wall_ns,
                                         identification.verdict_json);
                !done)
                return done;
        }
        return {};
    });
}

Result<std::int64_t> Store::record_event(const EventRecord& event) {
    auto& database = parts_->database();
    const auto done = in_transaction(*parts_, [&] {
        return database.run(
            "INSERT INTO events (test_id, wall_ns, time_s, kind, channel, message) VALUES (?, ?, ?, ?, ?, ?)",
            event.test_id, event.wall_ns, event.time_s, event.kind, event.channel, event.message);
    });
    if (!done) return std::unexpected(done.error());
    return database.last_insert_id();
}

Result<std::int64_t> Store::record_archive(const ArchiveRecord& archive) {
    auto& database = parts_->database();
    if (auto valid = check_json("archive", archive.spectrum_json); !valid)
        return std::unexpected(valid.error());
    const auto done = in_transaction(*parts_, [&] {
        return database.run(
            "INSERT INTO archive (machine, test_id, created_wall_ns, spectrum) VALUES (?, ?, ?, ?)",
            archive.machine, archive.test_id, archive.created_wall_ns, archive.spectrum_json);
    });
    if (!done) return std::unexpected(done.error());
    return database.last_insert_id();
}

Result<void> Store::set_state(TestId id, TestState state, Moment now, std::string_view reason) {
    auto& database = parts_->database();
    const bool ends = state == TestState::stopped || state == TestState::aborted;
    auto done = in_transaction(*parts_, [&]() -> Result<void> {
        const auto test = read().test(id);
        if (!test) return std::unexpected(test.error());
        if (!may_follow(test->state, state))
            return fail(NextStep::refuse_input, fmt::format("test {} is {}: it cannot become {}", id,
                                                            to_string(test->state), to_string(state)));
        if (!ends)
            return database.run("UPDATE tests SET state = ?, stop_reason = ? WHERE id = ?", to_string(state),
                                reason, id);
        return database.run(
            "UPDATE tests SET state = ?, ended_wall_ns = ?, ended_monotonic_ns = ?, stop_reason = ? WHERE id "
            "= ?",
            to_string(state), now.wall_ns, now.monotonic_ns, reason, id);
    });
    // A reader may hold the log at this moment; the test has ended all the same.
    if (done && ends) {
        fold_wal(database);
        database.set_busy_timeout_ms(parts_->busy_timeout_ms);
    }
    return done;
}

Result<std::optional<ResumedTest>> Store::resume() const {
    auto& database = parts_->database();
    Transaction snapshot(database, Transaction::Kind::read);
    if (!snapshot.begun()) return std::unexpected(snapshot.begun().error());
    auto test = read().open_test();
    if (!test) return std::unexpected(test.error());
    if (!*test) return std::optional<ResumedTest>{};
    ResumedTest resumed;
    resumed.test = std::move(**test);
    auto declarations = read().declarations(resumed.test.id);
    if (!declarations) return std::unexpected(declarations.error());
    resumed.declarations = std::move(*declarations);
    auto identifications = read().latest_identifications(resumed.test.id);
    if (!identifications) return std::unexpected(identifications.error());
    resumed.identifications = std::move(*identifications);
    return std::optional(std::move(resumed));
}

Result<void> Store::checkpoint() {
    return parts_->database().execute("PRAGMA wal_checkpoint(PASSIVE)");
}

std::uint64_t Store::wal_bytes() const {
    return size_of(parts_->database().path().string() + "-wal");
}

std::uint64_t Store::database_bytes() const {
    return size_of(parts_->database().path());
}

}  // namespace thermbal
