#include "sqlite.hpp"

#include <cmath>
#include <limits>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sqlite3.h>

namespace thermbal::sqlite {

namespace {

/// Only what SQLite itself calls damage is damage. Everything else may be in order again at a later call: the
/// disk, a lock, also a table that another program altered.
NextStep next_step(int code) {
    switch (code & 0xff) {
        case SQLITE_CORRUPT:
        case SQLITE_NOTADB:
            return NextStep::stop;
        case SQLITE_CONSTRAINT:
        case SQLITE_MISMATCH:
        case SQLITE_TOOBIG:
        case SQLITE_RANGE:
            return NextStep::refuse_input;
        default:
            return NextStep::retry;
    }
}

std::string_view what_to_do(int code) {
    switch (code & 0xff) {
        case SQLITE_BUSY:
        case SQLITE_LOCKED:
            return "; another program holds a lock on it: close what has it open for writing";
        case SQLITE_FULL:
            return "; the disk is full: free some space";
        case SQLITE_READONLY:
            return "; it or its folder cannot be written: check the mount and the permissions";
        case SQLITE_CANTOPEN:
            return "; check that the folder exists and may be written";
        case SQLITE_CORRUPT:
        case SQLITE_NOTADB:
            return "; the file is damaged: keep it aside and try `sqlite3 FILE .recover`";
        case SQLITE_ERROR:
        case SQLITE_SCHEMA:
            return "; if another program altered its tables, undo that";
        default:
            return "";
    }
}

Error error_of(sqlite3* database, int code) {
    const char* file = database == nullptr ? nullptr : sqlite3_db_filename(database, "main");
    return {next_step(code),
            fmt::format("database {}: {} (SQLite {}){}", file == nullptr ? "" : file,
                        database == nullptr ? sqlite3_errstr(code) : sqlite3_errmsg(database), code,
                        what_to_do(code))};
}

}  // namespace

Statement::Statement(sqlite3* database, std::string_view sql) : database_(database) {
    take(sqlite3_prepare_v2(database, sql.data(), static_cast<int>(sql.size()), &statement_, nullptr));
}

Statement::Statement(Statement&& other) noexcept
    : database_(other.database_),
      statement_(std::exchange(other.statement_, nullptr)),
      error_(std::move(other.error_)) {}

Statement::~Statement() {
    sqlite3_finalize(statement_);
}

void Statement::take(int code) {
    if (code != SQLITE_OK && !error_) error_ = error_of(database_, sqlite3_extended_errcode(database_));
}

void Statement::rewind() {
    // The code of reset repeats that of the last step, which has been taken already.
    if (!error_) sqlite3_reset(statement_);
}

void Statement::bind_one(int index, std::int64_t value) {
    if (!error_) take(sqlite3_bind_int64(statement_, index, value));
}

void Statement::bind_one(int index, double value) {
    if (!error_) take(sqlite3_bind_double(statement_, index, value));
}

void Statement::bind_one(int index, std::string_view value) {
    // A null pointer would bind NULL; an empty text is not that.
    const char* data = value.empty() ? "" : value.data();
    if (!error_)
        take(sqlite3_bind_text64(statement_, index, data, value.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
}

void Statement::bind_one(int index, std::nullopt_t) {
    if (!error_) take(sqlite3_bind_null(statement_, index));
}

bool Statement::next() {
    if (error_) return false;
    const int code = sqlite3_step(statement_);
    if (code == SQLITE_ROW) return true;
    if (code != SQLITE_DONE) take(code);
    return false;
}

Result<void> Statement::status() const {
    if (error_) return std::unexpected(*error_);
    return {};
}

Result<void> Statement::run() {
    while (next()) {
    }
    return status();
}

std::int64_t Statement::integer(int column) const {
    return sqlite3_column_int64(statement_, column);
}

double Statement::real(int column) const {
    return null(column) ? std::numeric_limits<double>::quiet_NaN()
                        : sqlite3_column_double(statement_, column);
}

std::string Statement::text(int column) const {
    const auto* text = sqlite3_column_text(statement_, column);
    if (text == nullptr) return {};
    return {reinterpret_cast<const char*>(text),
            static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

bool Statement::null(int column) const {
    return sqlite3_column_type(statement_, column) == SQLITE_NULL;
}

std::optional<std::int64_t> Statement::optional_integer(int column) const {
    if (null(column)) return std::nullopt;
    return integer(column);
}

namespace {

std::string uri_of(const std::filesystem::path& path, OpenMode mode) {
    std::string uri = "file:";
    std::error_code error;
    const auto absolute = std::filesystem::absolute(path, error);
    for (const char c : error ? path.string() : absolute.string()) {
        if (c == '?' || c == '#' || c == '%')
            uri += fmt::format("%{:02X}", static_cast<unsigned>(c));
        else
            uri += c;
    }
    switch (mode) {
        case OpenMode::read_only:
            return uri + "?mode=ro";
        case OpenMode::read_only_medium:
            return uri + "?mode=ro&immutable=1";
        case OpenMode::read_write:
            return uri + "?mode=rw";
    }
    return uri;
}

}  // namespace

Result<std::shared_ptr<Database>> Database::open(const std::filesystem::path& path, OpenMode mode,
                                                 int busy_timeout_ms) {
    sqlite3* handle = nullptr;
    const int flags = (mode == OpenMode::read_write ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY) |
                      SQLITE_OPEN_URI | SQLITE_OPEN_FULLMUTEX | SQLITE_OPEN_EXRESCODE;
    const int code = sqlite3_open_v2(uri_of(path, mode).c_str(), &handle, flags, nullptr);
    std::shared_ptr<Database> database(new Database(handle, path));
    if (code == SQLITE_CANTOPEN && mode != OpenMode::read_write) {
        return fail(next_step(code),
                    fmt::format("database {}: cannot be opened to read: check that it is there "
                                "and that you may read it",
                                path.string()));
    }
    if (code != SQLITE_OK) return std::unexpected(error_of(handle, code));
    sqlite3_busy_timeout(handle, busy_timeout_ms);
    // mmap: a bad sector would be a SIGBUS instead of an error.
    if (auto set =
            database->execute("PRAGMA mmap_size = 0; PRAGMA foreign_keys = ON; PRAGMA trusted_schema = OFF;"
                              "PRAGMA cell_size_check = ON;");
        !set)
        return std::unexpected(set.error());
    return database;
}

Database::~Database() {
    sqlite3_close_v2(handle_);
}

Result<void> Database::execute(const std::string& sql) {
    const int code = sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr);
    if (code != SQLITE_OK) return std::unexpected(error_of(handle_, code));
    return {};
}

Result<std::int64_t> Database::integer(std::string_view sql) {
    auto row = query(sql);
    const std::int64_t value = row.next() ? row.integer(0) : 0;
    if (auto status = row.status(); !status) return std::unexpected(status.error());
    return value;
}

void Database::set_busy_timeout_ms(int milliseconds) {
    sqlite3_busy_timeout(handle_, milliseconds);
}

std::int64_t Database::last_insert_id() const {
    return sqlite3_last_insert_rowid(handle_);
}

std::int64_t Database::changes() const {
    return sqlite3_changes64(handle_);
}

bool Database::in_transaction() const {
    return sqlite3_get_autocommit(handle_) == 0;
}

void Database::leave_wal_alone_on_close() {
    sqlite3_db_config(handle_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
}

void Database::keep_wal_file() {
    int on = 1;
    sqlite3_file_control(handle_, "main", SQLITE_FCNTL_PERSIST_WAL, &on);
}

// An interrupt is forgotten by a statement that begins after it, which therefore looks itself; a check of the
// pages is one step and looks for nothing but the interrupt.
EndsWhenStopped::EndsWhenStopped(Database& database, std::stop_token stop)
    : handle_(database.handle_),
      stop_(std::move(stop)),
      interrupt_(stop_, [handle = handle_] { sqlite3_interrupt(handle); }) {
    sqlite3_progress_handler(
        handle_, 1,
        [](void* token) { return static_cast<const std::stop_token*>(token)->stop_requested() ? 1 : 0; },
        &stop_);
}

EndsWhenStopped::~EndsWhenStopped() {
    sqlite3_progress_handler(handle_, 0, nullptr, nullptr);
}

Transaction::Transaction(Database& database, Kind kind)
    : database_(database), outermost_(!database.in_transaction()) {
    if (outermost_) begun_ = database_.execute(kind == Kind::write ? "BEGIN IMMEDIATE" : "BEGIN");
}

Transaction::~Transaction() {
    // SQLite has rolled back by itself after some errors.
    if (!outermost_ || !database_.in_transaction()) return;
    [[maybe_unused]] const auto rolled_back = database_.execute("ROLLBACK");
}

Result<void> Transaction::commit() {
    if (!outermost_) return {};
    return database_.execute("COMMIT");
}

}  // namespace thermbal::sqlite
