#include "frame_line.hpp"

#include "columns.hpp"

namespace thermbal {
namespace {

/// The sixteen colours that every terminal maps to something readable on its own background.
std::string_view sequence(Ink ink) {
    switch (ink) {
        case Ink::plain:
            return "";
        case Ink::dim:
            return "\x1b[2m";
        case Ink::bold:
            return "\x1b[1m";
        case Ink::good:
            return "\x1b[32m";
        case Ink::good_bold:
            return "\x1b[1;32m";
        case Ink::warning:
            return "\x1b[33m";
        case Ink::bad:
            return "\x1b[1;31m";
        case Ink::title:
            return "\x1b[7m";
    }
    return "";
}

}  // namespace

void FrameLine::add(std::string_view text, Ink ink) {
    const std::string shown = clipped(printable(text), left());
    if (shown.empty()) return;
    used_ += display_width(shown);
    const bool inked = colour_ && ink != Ink::plain;
    if (inked) line_ += sequence(ink);
    line_ += shown;
    if (inked) line_ += "\x1b[0m";
}

void FrameLine::fill_to(std::size_t column, Ink ink) {
    const std::size_t end = column < columns_ ? column : columns_;
    if (end > used_) add(std::string(end - used_, ' '), ink);
}

}  // namespace thermbal
