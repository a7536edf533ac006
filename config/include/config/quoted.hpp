#pragma once

#include <string>
#include <string_view>

namespace thermbal {

/// A string as TOML writes it, with its quotes.
std::string toml_quoted(std::string_view text);

}  // namespace thermbal
