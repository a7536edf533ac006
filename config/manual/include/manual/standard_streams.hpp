#pragma once

#include <cerrno>
#include <cstdio>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <unistd.h>

#include "base/errno_text.hpp"
#include "base/error.hpp"

namespace thermbal {

/// First thing in main: a standard stream that was closed would be the next file or socket that is opened,
/// and what is printed would go into it. A closed input reads nothing, a closed output takes nothing: writing
/// to it is an error.
inline void keep_standard_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (fcntl(stream, F_GETFD) != -1) continue;
        // The lowest that is free. What nobody reads may be said to the end; an answer that nobody gets may
        // not.
        if (open("/dev/null", stream == STDERR_FILENO ? O_WRONLY : O_RDONLY) != stream) return;
    }
}

/// All of it, or an error (stop) that says why not. Once something was lost, every later call says so.
inline Result<void> print_out(std::string_view text) {
    int mistake = 0;
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) mistake = errno;
    if (std::fflush(stdout) != 0) mistake = errno;
    if (mistake == 0 && std::ferror(stdout) == 0) return {};
    return fail(NextStep::stop,
                "standard output: " + (mistake == 0 ? "not all of it was taken" : errno_text(mistake)));
}

/// Where nothing takes it there is nobody to tell.
inline void print_error_line(const std::string& text) {
    std::fputs((text + "\n").c_str(), stderr);
}

}  // namespace thermbal
