#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "ask.hpp"
#include "store/reader.hpp"

namespace thermbal {

struct DatabaseOptions {
    AskOptions ask;  ///< the daemon that says where its database is, when `database` is empty
    std::string database;
};

/// By its name, or by the daemon that answers. Read only.
Result<Reader> open_database(const DatabaseOptions& options);

// On the database itself, beside a running daemon or without one. Each returns the exit status.

/// The id that is asked for, else the newest test's. Errors (refuse_input): there is none yet.
Result<TestId> wanted_test(const Reader& reader, std::optional<std::int64_t> test);

/// "2026-11-22 06:35:00" in the zone of this machine.
std::string local_time(std::int64_t wall_ns);

/// The newest stored tests, newest first, at most `limit`.
int run_tests(const DatabaseOptions& options, std::int64_t limit);

/// A test (without an id the newest) as the CSV of INTERFACES, into a file or "-".
int run_export(const DatabaseOptions& options, std::optional<std::int64_t> test, const std::string& csv);

/// 1 when anything is wrong with the file.
int run_verify(const DatabaseOptions& options);

int run_backup(const DatabaseOptions& options, const std::string& copy);

}  // namespace thermbal
