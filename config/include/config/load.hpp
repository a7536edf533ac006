#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "config/config.hpp"

namespace thermbal {

/// A profile by the name (or path) that a [[unit]] gives.
using ProfileLookup = std::function<Result<ModuleProfile>(std::string_view name)>;

/// Parses and checks a configuration. Touches no file: `file_name` stands in the messages, profiles come from
/// `lookup`. Error (refuse_input): one line `FILE:LINE:COLUMN: key: found, accepted` for every mistake, in
/// the order of the file. Unknown keys are mistakes.
Result<Config> load_config(std::string_view toml, std::string_view file_name, const ProfileLookup& lookup);

/// [identification] of the configuration that a test was stored with, perhaps by an older version: defaults
/// where it says nothing that is accepted today.
IdentificationConfig stored_identification(std::string_view toml);

/// The effective configuration, defaults included, as TOML that load_config accepts and that means the same.
std::string explain_config(const Config& config);

/// A module profile from TOML; errors as load_config.
Result<ModuleProfile> load_profile(std::string_view toml, std::string_view file_name);

/// A profile as TOML that load_profile accepts and that means the same.
std::string explain_profile(const ModuleProfile& profile);

/// The text of a file of at most `most_bytes`; error (refuse_input) names it and the system's reason.
Result<std::string> read_text_file(const std::string& path, std::size_t most_bytes = std::size_t{4} << 20);

/// Where profiles are looked for: the user's own folders first, then /etc/thermbal/profiles, then the ones
/// that came with the running program.
std::vector<std::string> profile_folders(std::vector<std::string> own);

/// Looks NAME up as NAME.toml in the folders, the first that has it wins; a name with a '/' or ending in
/// ".toml" is a path. Reads the file at every call.
ProfileLookup profiles_in(std::vector<std::string> folders);

/// read_text_file and load_config.
Result<Config> load_config_file(const std::string& path, const ProfileLookup& lookup);

}  // namespace thermbal
