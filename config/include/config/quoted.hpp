#pragma once

#include <string>
#include <string_view>

#include "modbus/link.hpp"

namespace thermbal {

/// A string as TOML writes it, with its quotes.
std::string toml_quoted(std::string_view text);

// As [[line]] names them.
std::string_view transport_name(Transport transport);
std::string_view parity_name(char parity);

}  // namespace thermbal
