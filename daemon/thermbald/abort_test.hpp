#pragma once

#include <filesystem>
#include <string>

#include "base/error.hpp"
#include "store/records.hpp"

namespace thermbal {

/// Ends the test that is open in a database as aborted, without a daemon: when the set-up that it was begun
/// with is gone. Returns what was done, for a person. Errors are those of Store; `refuse_input`: a daemon has
/// it.
Result<std::string> abort_open_test(const std::filesystem::path& database, Moment now);

}  // namespace thermbal
