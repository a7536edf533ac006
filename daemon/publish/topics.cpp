#include "publish/topics.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <mosquitto.h>

namespace thermbal {
namespace {

bool is_reserved(char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 || byte == 0x7f || c == '/' || c == '+' || c == '#' || c == '%';
}

bool is_utf8(std::string_view text) {
    return mosquitto_validate_utf8(text.data(), static_cast<int>(text.size())) == MOSQ_ERR_SUCCESS;
}

}  // namespace

std::string topic_level(std::string_view name) {
    std::string level;
    const bool only_ascii_stays = !is_utf8(name);
    for (const char c : name) {
        // Topics that begin with $ are the broker's own.
        const bool reserved = is_reserved(c) || (c == '$' && level.empty()) ||
                              (only_ascii_stays && static_cast<unsigned char>(c) >= 0x80);
        level += reserved ? fmt::format("%{:02X}", static_cast<unsigned char>(c)) : std::string(1, c);
    }
    return level.empty() ? "_" : level;
}

Topics::Topics(std::string_view prefix, std::string_view machine) {
    while (!prefix.empty()) {
        const std::size_t end = std::min(prefix.find('/'), prefix.size());
        if (end > 0) root_ += topic_level(prefix.substr(0, end)) + "/";
        prefix.remove_prefix(std::min(end + 1, prefix.size()));
    }
    root_ += topic_level(machine);
}

}  // namespace thermbal
