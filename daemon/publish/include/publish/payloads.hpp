#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "store/records.hpp"

namespace thermbal {

// What a message says, as JSON. Units stand in the names; a number that is not known is null, and so is the
// value of a reading that is not good (its quality says why). `at` is UTC, ISO 8601 with milliseconds. Pure
// functions.

/// "2026-11-22T04:31:07.250Z".
std::string utc_time(std::int64_t wall_ns);

/// One scan. `database`, `test` and `scan` together name it once and for all: the same three again replace
/// what came before. `revised`: it has changed since it was stored first.
nlohmann::json samples_payload(const std::string& database, const StoredTest& test, const ScanRecord& scan,
                               bool revised);

/// `withdrawn` is null while the declaration stands, else why it does not.
nlohmann::json declaration_payload(const std::string& database, const StoredTest& test,
                                   const DeclarationRecord& declaration);

nlohmann::json event_payload(const std::string& database, const EventRecord& event);

/// The newest test with its channels, each with the declaration that stands.
nlohmann::json test_payload(const std::string& database, const StoredTest& test,
                            const std::vector<DeclarationRecord>& declarations);

}  // namespace thermbal
