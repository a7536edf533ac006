#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "base/error.hpp"
#include "store/feed.hpp"

namespace thermbal {

/// A position as JSON, and back; nullopt for what is none.
std::string position_text(const FeedPosition& position);
std::optional<FeedPosition> position_in(std::string_view text);

/// nullopt without a file, or with one that is damaged: sending then begins as at the first start, which
/// doubles messages and loses none.
std::optional<FeedPosition> load_position(const std::filesystem::path& path);

/// Atomic and on the disk when it returns: after a power cut the file holds the old position or the new one.
Result<void> save_position(const std::filesystem::path& path, const FeedPosition& position);

}  // namespace thermbal
