#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace thermbal {

enum class Ink { plain, dim, bold, good, good_bold, warning, bad, title };

/// One line of a screen, of a fixed width in columns. What does not fit is clipped.
class FrameLine {
  public:
    FrameLine(std::size_t columns, bool colour) : columns_(columns), colour_(colour) {}

    /// Made printable first.
    void add(std::string_view text, Ink ink = Ink::plain);
    /// Spaces up to a column.
    void fill_to(std::size_t column, Ink ink = Ink::plain);
    std::size_t left() const { return columns_ - used_; }
    const std::string& str() const { return line_; }

  private:
    std::size_t columns_;
    bool colour_;
    std::size_t used_ = 0;
    std::string line_;
};

}  // namespace thermbal
