#pragma once

#include <string>
#include <string_view>

#include "base/error.hpp"

namespace thermbal {

/// The whole of a file, at most 1 GiB. Errors (refuse_input) name it and the system's reason.
Result<std::string> read_file(const std::string& path);

/// Replaces a file's content; "-" is standard output. Errors (stop) name it and the system's reason.
Result<void> write_file(const std::string& path, std::string_view content);

}  // namespace thermbal
