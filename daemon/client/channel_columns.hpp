#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "frame_line.hpp"

namespace thermbal {

struct ChannelCell {
    std::string text;
    Ink ink = Ink::plain;
};

/// A column of the live view's table.
struct ChannelColumn {
    std::string title;
    std::size_t width = 0;
    std::size_t most_width = 0;  ///< it may grow to this when there is room
    int rank = 0;                ///< the highest goes first when there is no room
    bool is_number = false;
    std::function<ChannelCell(const nlohmann::json& channel, std::size_t width)> cell;
};

/// The columns that fit beside each other, one space between, widened to the room there is. `channels` is
/// what they are to show: a column that says nothing of any channel is left out.
std::vector<ChannelColumn> fitting_columns(const nlohmann::json& channels, std::size_t width, bool unicode);

}  // namespace thermbal
