#include "files.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include <fmt/format.h>

#include "config/load.hpp"
#include "manual/standard_streams.hpp"

namespace thermbal {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

}  // namespace

Result<std::string> read_file(const std::string& path) {
    return read_text_file(path, std::size_t{1} << 30);
}

Result<void> write_file(const std::string& path, std::string_view content) {
    if (path == "-") return print_out(content);
    const File file(std::fopen(path.c_str(), "wb"), std::fclose);
    if (!file || std::fwrite(content.data(), 1, content.size(), file.get()) != content.size() ||
        std::fflush(file.get()) != 0) {
        return fail(NextStep::stop, fmt::format("{}: {}", path, strerrordesc_np(errno)));
    }
    return {};
}

}  // namespace thermbal
