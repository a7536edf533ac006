#include "publish/position_file.hpp"

#include <cerrno>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "base/errno_text.hpp"
#include "config/load.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

std::optional<std::int64_t> integer_in(const json& document, const char* key) {
    const auto found = document.find(key);
    if (found == document.end() || !found->is_number_integer()) return std::nullopt;
    return found->get<std::int64_t>();
}

std::unexpected<Error> cannot_write(const std::filesystem::path& path) {
    return fail(NextStep::retry, fmt::format("{}: cannot be written: {}", path.string(), errno_text(errno)));
}

bool write_all(int fd, std::string_view text) {
    while (!text.empty()) {
        const ssize_t written = write(fd, text.data(), text.size());
        if (written < 0 && errno != EINTR) return false;
        if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    }
    return fsync(fd) == 0;
}

/// A rename is on the disk when its folder is.
void sync_folder(const std::filesystem::path& folder) {
    const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return;
    fsync(fd);
    close(fd);
}

}  // namespace

std::string position_text(const FeedPosition& position) {
    return json{{"database", position.database_id},
                {"test", position.test_id},
                {"scan", position.scan},
                {"revision", position.revision_id},
                {"declaration", position.declaration_id},
                {"event", position.event_id}}
               .dump() +
           "\n";
}

std::optional<FeedPosition> position_in(std::string_view text) {
    const json document = json::parse(text, nullptr, false);
    if (!document.is_object() || !document.contains("database") || !document["database"].is_string())
        return std::nullopt;
    const auto test = integer_in(document, "test");
    const auto scan = integer_in(document, "scan");
    const auto revision = integer_in(document, "revision");
    const auto declaration = integer_in(document, "declaration");
    const auto event = integer_in(document, "event");
    if (!test || !scan || !revision || !declaration || !event) return std::nullopt;
    return FeedPosition{
        document["database"].get<std::string>(), *test, *scan, *revision, *declaration, *event};
}

std::optional<FeedPosition> load_position(const std::filesystem::path& path) {
    const auto text = read_text_file(path.string(), std::size_t{64} * 1024);
    return text ? position_in(*text) : std::nullopt;
}

Result<void> save_position(const std::filesystem::path& path, const FeedPosition& position) {
    const std::filesystem::path fresh = path.string() + ".new";
    const int fd = open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (fd < 0) return cannot_write(fresh);
    const bool written = write_all(fd, position_text(position));
    const int reason = errno;
    close(fd);
    errno = reason;
    if (!written) return cannot_write(fresh);
    if (rename(fresh.c_str(), path.c_str()) != 0) return cannot_write(path);
    sync_folder(path.parent_path());
    return {};
}

}  // namespace thermbal
