#pragma once

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "modes/archive.hpp"

namespace thermbal {

/// What a finished test leaves in the database for the next one, and back. Errors (stop): not what
/// spectrum_to_json writes.
nlohmann::json spectrum_to_json(const ArchivedSpectrum& spectrum);
Result<ArchivedSpectrum> spectrum_from_json(const nlohmann::json& json);

}  // namespace thermbal
