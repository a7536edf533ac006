#pragma once

#include <string>
#include <string_view>

#include "base/error.hpp"
#include "network/model.hpp"

namespace thermbal {

/// A simulation model from TOML: config/models/README.md says the keys. Touches no file: `file_name` stands
/// in the messages. Error (refuse_input): one line `FILE:LINE:COLUMN: key: found, accepted` for every
/// mistake, in the order of the file; unknown keys and everything that check_model finds are mistakes.
Result<Model> load_model(std::string_view toml, std::string_view file_name);

/// The model as TOML that load_model accepts and that means the same. `comment` stands above it, every line
/// behind #.
std::string write_model(const Model& model, std::string_view comment = {});

}  // namespace thermbal
