#pragma once

#include <expected>
#include <string>
#include <utility>

namespace thermbal {

/// What the caller does next: the one thing about an error that code may branch on.
enum class NextStep {
    retry,         ///< nothing is lost; the same call may succeed later
    reopen_link,   ///< the exchange is in doubt; nothing of it is used, drain or reconnect
    mark_sample,   ///< the value is not a reading; store it with its quality
    refuse_input,  ///< a file, flag, request or configuration is wrong; a person has to mend it
    stop,          ///< going on would be dishonest or impossible
};

/// `message` is one line for a person: what was found, where, and what would be accepted.
struct Error {
    NextStep next = NextStep::stop;
    std::string message;
};

template <typename T>
using Result = std::expected<T, Error>;

inline std::unexpected<Error> fail(NextStep next, std::string message) {
    return std::unexpected(Error{next, std::move(message)});
}

}  // namespace thermbal
