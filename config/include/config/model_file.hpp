#pragma once

#include <functional>
#include <set>
#include <string>
#include <string_view>

#include "base/error.hpp"
#include "network/model.hpp"

namespace thermbal {

/// The columns that a test has.
struct TestColumns {
    std::set<std::string, std::less<>> channels;
    std::set<std::string, std::less<>> inputs;
};

/// A simulation model from TOML: config/models/README.md says the keys. Touches no file: `file_name` stands
/// in the messages. Error (refuse_input): one line `FILE:LINE:COLUMN: key: found, accepted` for every
/// mistake, in the order of the file; unknown keys and everything that check_model finds are mistakes.
Result<Model> load_model(std::string_view toml, std::string_view file_name);

/// The same for a test with these channels and known inputs: a column that the model asks for and the test
/// does not have is a mistake, too, and so is a model of which the test measures nothing.
Result<Model> load_model(std::string_view toml, std::string_view file_name, const TestColumns& columns);

/// The model as TOML that load_model accepts and that means the same. `comment` stands above it, every line
/// behind #.
std::string write_model(const Model& model, std::string_view comment = {});

}  // namespace thermbal
