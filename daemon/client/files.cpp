#include "files.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include <fmt/format.h>

namespace thermbal {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

}  // namespace

Result<std::string> read_file(const std::string& path) {
    constexpr std::size_t most_bytes = std::size_t{1} << 30;
    const File file(std::fopen(path.c_str(), "rb"), std::fclose);
    const auto refuse = [&](std::string_view why) {
        return fail(NextStep::refuse_input, fmt::format("{}: {}", path, why));
    };
    if (!file) return refuse(strerrordesc_np(errno));
    std::string text;
    std::string buffer(1 << 16, '\0');
    for (std::size_t got = 0; (got = std::fread(buffer.data(), 1, buffer.size(), file.get())) > 0;) {
        text.append(buffer, 0, got);
        if (text.size() > most_bytes) return refuse("larger than 1 GiB");
    }
    if (std::ferror(file.get()) != 0) return refuse(strerrordesc_np(errno));
    return text;
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
