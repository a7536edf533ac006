#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

#include "base/error.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace thermbal::sqlite {

/// A prepared statement. The first failure sticks: every later bind or step does nothing, and `status` tells
/// it; so a query is written as one loop and one check.
class Statement {
  public:
    Statement(sqlite3* database, std::string_view sql);
    Statement(Statement&&) noexcept;
    Statement& operator=(Statement&&) = delete;
    ~Statement();

    template <typename... Values>
    Statement& bind(const Values&... values) {
        rewind();
        int index = 0;
        (bind_one(++index, values), ...);
        return *this;
    }

    /// True with the next row; false at the end or after a failure.
    bool next();
    Result<void> status() const;
    /// Steps to the end.
    Result<void> run();

    std::int64_t integer(int column) const;
    /// NULL is NaN.
    double real(int column) const;
    std::string text(int column) const;
    bool null(int column) const;
    std::optional<std::int64_t> optional_integer(int column) const;

  private:
    void rewind();
    void bind_one(int index, std::int64_t value);
    void bind_one(int index, int value) { bind_one(index, std::int64_t{value}); }
    void bind_one(int index, bool value) { bind_one(index, std::int64_t{value}); }
    void bind_one(int index, double value);  ///< NaN is NULL
    void bind_one(int index, std::string_view value);
    void bind_one(int index, const std::string& value) { bind_one(index, std::string_view(value)); }
    void bind_one(int index, const char* value) { bind_one(index, std::string_view(value)); }
    void bind_one(int index, std::nullopt_t);
    template <typename T>
    void bind_one(int index, const std::optional<T>& value) {
        if (value)
            bind_one(index, *value);
        else
            bind_one(index, std::nullopt);
    }
    void take(int code);

    sqlite3* database_;
    sqlite3_stmt* statement_ = nullptr;
    std::optional<Error> error_;
};

enum class OpenMode : std::uint8_t { read_only, read_only_medium, read_write };

/// One connection. One thread at a time.
class Database {
  public:
    static Result<std::shared_ptr<Database>> open(const std::filesystem::path& path, OpenMode mode,
                                                  int busy_timeout_ms);
    Database(const Database&) = delete;
    Database& operator=(const Database&) = delete;
    ~Database();

    template <typename... Values>
    Statement query(std::string_view sql, const Values&... values) {
        Statement statement(handle_, sql);
        statement.bind(values...);
        return statement;
    }
    template <typename... Values>
    Result<void> run(std::string_view sql, const Values&... values) {
        return query(sql, values...).run();
    }
    /// Several statements, without values.
    Result<void> execute(const std::string& sql);
    /// The first column of the first row.
    Result<std::int64_t> integer(std::string_view sql);

    void set_busy_timeout_ms(int milliseconds);
    std::int64_t last_insert_id() const;
    std::int64_t changes() const;  ///< rows that the last statement changed
    bool in_transaction() const;

    /// A connection that only looked must not fold the WAL into the file as it closes.
    void leave_wal_alone_on_close();
    /// -wal and -shm stay after the last close, so that a reader of another user, who may not create them,
    /// can open.
    void keep_wal_file();

    const std::filesystem::path& path() const { return path_; }

  private:
    friend class EndsWhenStopped;
    Database(sqlite3* handle, std::filesystem::path path) : handle_(handle), path_(std::move(path)) {}
    sqlite3* handle_;
    std::filesystem::path path_;
};

/// While it lives, the connection's statements end with an error (`retry`) once `stop` is requested, those
/// too that begin after that.
class EndsWhenStopped {
  public:
    EndsWhenStopped(Database& database, std::stop_token stop);
    EndsWhenStopped(const EndsWhenStopped&) = delete;
    EndsWhenStopped& operator=(const EndsWhenStopped&) = delete;
    ~EndsWhenStopped();

  private:
    sqlite3* handle_;
    std::stop_token stop_;
    std::stop_callback<std::function<void()>> interrupt_;
};

/// Rolls back unless committed. Inside a transaction that is open already it is part of that one.
class Transaction {
  public:
    enum class Kind : std::uint8_t { read, write };
    Transaction(Database& database, Kind kind);
    Transaction(const Transaction&) = delete;
    Transaction& operator=(const Transaction&) = delete;
    ~Transaction();

    /// Whether it could begin.
    const Result<void>& begun() const { return begun_; }
    Result<void> commit();

  private:
    Database& database_;
    bool outermost_;
    Result<void> begun_;
};

}  // namespace thermbal::sqlite
