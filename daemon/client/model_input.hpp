#pragma once

#include <string>

#include "base/error.hpp"
#include "network/model.hpp"
#include "series/recorded_test.hpp"

namespace thermbal {

/// A model file, and a recorded test, as the commands on models take them. Errors (refuse_input) say file,
/// line and column.
Result<Model> read_model(const std::string& path);
Result<RecordedTest> read_recorded_test(const std::string& path);

}  // namespace thermbal
