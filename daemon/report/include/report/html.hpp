#pragma once

#include <string>
#include <string_view>

namespace thermbal {

/// Text from outside (names, places, remarks, file names) as HTML text or as a quoted attribute's value.
std::string escaped(std::string_view text);

}  // namespace thermbal
