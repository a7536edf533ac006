#pragma once

#include <string>
#include <system_error>

namespace thermbal {

/// What the C library says of an errno value, on any thread.
inline std::string errno_text(int code) {
    return std::generic_category().message(code);
}

}  // namespace thermbal
