#include "columns.hpp"

#include <algorithm>
#include <cwchar>

namespace thermbal {
namespace {

struct Character {
    std::string_view bytes;
    std::size_t width = 1;
    bool printable = true;
};

/// The first character of a text that is not empty. What the locale cannot decode is one byte, not printable.
Character first_character(std::string_view text) {
    const auto byte = static_cast<unsigned char>(text.front());
    if (byte < 0x80) return {text.substr(0, 1), 1, byte >= 0x20 && byte != 0x7f};
    wchar_t wide = 0;
    std::mbstate_t state{};
    // NOLINTNEXTLINE(concurrency-mt-unsafe): the state is our own
    const std::size_t length = std::mbrtowc(&wide, text.data(), text.size(), &state);
    if (length == 0 || length > text.size()) return {text.substr(0, 1), 1, false};
    const int width = wcwidth(wide);
    return {text.substr(0, length), width < 0 ? 1 : static_cast<std::size_t>(width), width >= 0};
}

template <typename Body>
void for_each_character(std::string_view text, Body body) {
    while (!text.empty()) {
        const Character character = first_character(text);
        if (!body(character)) return;
        text.remove_prefix(character.bytes.size());
    }
}

}  // namespace

std::size_t display_width(std::string_view text) {
    std::size_t width = 0;
    for_each_character(text, [&](const Character& character) {
        width += character.width;
        return true;
    });
    return width;
}

std::string printable(std::string_view text) {
    std::string safe;
    for_each_character(text, [&](const Character& character) {
        const bool is_space = character.bytes == "\n" || character.bytes == "\t";
        safe += is_space ? " " : character.printable ? character.bytes : "?";
        return true;
    });
    return safe;
}

std::string clipped(std::string_view text, std::size_t width) {
    if (display_width(text) <= width) return std::string(text);
    if (width == 0) return {};
    std::string start;
    std::size_t used = 0;
    for_each_character(text, [&](const Character& character) {
        if (used + character.width > width - 1) return false;
        start += character.bytes;
        used += character.width;
        return true;
    });
    return start + "~";
}

std::string left_aligned(std::string_view text, std::size_t width) {
    std::string cell = clipped(text, width);
    return cell.append(width - display_width(cell), ' ');
}

std::string right_aligned(std::string_view text, std::size_t width) {
    const std::string cell = clipped(text, width);
    return std::string(width - display_width(cell), ' ') + cell;
}

void TextTable::add(std::vector<std::string> cells) {
    for (std::string& cell : cells) cell = printable(cell);
    rows_.push_back(std::move(cells));
}

std::string TextTable::str() const {
    std::vector<std::size_t> widths;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
        std::size_t width = display_width(columns_[i].title);
        for (const auto& row : rows_) width = std::max(width, display_width(row[i]));
        widths.push_back(width);
    }
    std::string whole;
    const auto add_line = [&](auto cell_of) {
        std::string line;
        for (std::size_t i = 0; i < columns_.size(); ++i) {
            if (i > 0) line += "  ";
            line += columns_[i].is_number ? right_aligned(cell_of(i), widths[i])
                                          : left_aligned(cell_of(i), widths[i]);
        }
        line.erase(line.find_last_not_of(' ') + 1);
        whole += line + "\n";
    };
    add_line([&](std::size_t i) { return columns_[i].title; });
    for (const auto& row : rows_) {
        add_line([&](std::size_t i) { return row[i]; });
    }
    return whole;
}

}  // namespace thermbal
