#pragma once

#include <string>
#include <string_view>

#include "base/error.hpp"

namespace thermbal {

/// Where a file named in [mqtt] is: a path, or "credential:NAME", a file that systemd put into
/// `credentials_folder`
/// ($CREDENTIALS_DIRECTORY: LoadCredential= or LoadCredentialEncrypted= of the unit).
Result<std::string> secret_path(std::string_view name, std::string_view credentials_folder);

/// What stands in such a file, without the end of the line. The message never holds anything of the file.
Result<std::string> read_secret(std::string_view name, std::string_view credentials_folder);

}  // namespace thermbal
