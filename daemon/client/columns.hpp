#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace thermbal {

/// Columns a terminal needs for a text in UTF-8 (wcwidth of the current LC_CTYPE; what it does not know
/// counts 1).
std::size_t display_width(std::string_view text);

/// Safe to print: no control characters, no escape sequences, valid in the current LC_CTYPE ('?' for the
/// rest). Names and messages come from the configuration and from other people.
std::string printable(std::string_view text);

/// At most `width` columns of a printable text; a cut is marked by "~" at its end.
std::string clipped(std::string_view text, std::size_t width);

/// Exactly `width` columns: clipped or filled up with spaces.
std::string left_aligned(std::string_view text, std::size_t width);
std::string right_aligned(std::string_view text, std::size_t width);

/// A table as text: columns as wide as their widest cell, two spaces between, numbers to the right.
class TextTable {
  public:
    struct Column {
        std::string title;
        bool is_number = false;
    };
    explicit TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {}
    /// REQUIRES: as many cells as columns. Cells are made printable.
    void add(std::vector<std::string> cells);
    std::string str() const;

  private:
    std::vector<Column> columns_;
    std::vector<std::vector<std::string>> rows_;
};

}  // namespace thermbal
