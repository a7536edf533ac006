#include "files.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include <fmt/format.h>

#include "config/load.hpp"

namespace thermbal {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

}  // namespace

Result<std::string> read_file(const std::string& path) {
    return read_text_file(path, std::size_t{1} << 30);
}

Result<void> write_file(const std::string& path, std::string_view content) {
    const bool to_standard_output = path == "-";
    const File file(to_standard_output ? nullptr : std::fopen(path.c_str(), "wb"), std::fclose);
    std::FILE* const out = to_standard_output ? stdout : file.get();
    if (out == nullptr || std::fwrite(content.data(), 1, content.size(), out) != content.size() ||
        std::fflush(out) != 0) {
        return fail(NextStep::stop, fmt::format("{}: {}", path, strerrordesc_np(errno)));
    }
    return {};
}

}  // namespace thermbal
