#pragma once

#include <array>
#include <cstdio>
#include <memory>
#include <string>

#include <fmt/format.h>

namespace thermbal::test {

struct Output {
    std::string text;  ///< both streams
    int status = -1;
};

/// thermbalctl with these arguments.
inline Output run(const std::string& arguments) {
    const std::string command = fmt::format("{}/thermbalctl {} 2>&1", THERMBAL_BIN_DIR, arguments);
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(popen(command.c_str(), "r"), pclose);
    Output output;
    std::array<char, 4096> buffer;
    for (std::size_t got = 0; (got = std::fread(buffer.data(), 1, buffer.size(), pipe.get())) > 0;) {
        output.text.append(buffer.data(), got);
    }
    output.status = WEXITSTATUS(pclose(pipe.release()));
    return output;
}

}  // namespace thermbal::test
