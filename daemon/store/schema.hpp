#pragma once

#include "base/error.hpp"
#include "sqlite.hpp"

namespace thermbal {

/// The version that this program reads and writes (PRAGMA user_version).
int schema_version();

/// Tells a database of ours (PRAGMA application_id, "thrm") from somebody else's.
inline constexpr std::int64_t application_id = 0x7468726d;

/// Refuses a file that is not ours; one that is newer; and, unless `may_migrate`, one that is older.
Result<void> check_schema(sqlite::Database& database, bool may_migrate);

/// Brings an empty or older database to schema_version(), all steps in one transaction.
Result<void> migrate(sqlite::Database& database);

}  // namespace thermbal
