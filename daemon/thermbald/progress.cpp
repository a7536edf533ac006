#include "progress.hpp"

#include <fmt/format.h>

namespace thermbal {

Progress::Progress(std::vector<std::string> line_names, std::int64_t limit_ns, std::int64_t now_ns)
    : limit_ns_(limit_ns) {
    parts_.push_back({"the store", now_ns});
    for (const std::string& name : line_names) parts_.push_back({fmt::format("line {}", name), now_ns});
}

void Progress::line_delivered(std::size_t line, std::int64_t now_ns) {
    parts_.at(line + 1).latest_ns = now_ns;
}

void Progress::store_answered(std::int64_t now_ns) {
    parts_.front().latest_ns = now_ns;
}

std::optional<std::string> Progress::standstill(std::int64_t now_ns) const {
    for (const Part& part : parts_) {
        if (now_ns - part.latest_ns <= limit_ns_) continue;
        return fmt::format("{} has made no progress for {:.1f} s", part.name,
                           static_cast<double>(now_ns - part.latest_ns) * 1e-9);
    }
    return std::nullopt;
}

}  // namespace thermbal
