#pragma once

#include <string_view>

#include <nlohmann/json.hpp>

#include "base/error.hpp"

namespace thermbal {

/// One line on standard error. Returns the exit status: 2 where a person has to mend what was given, else 1.
int report_error(const Error& error);

/// The text, or the document as JSON; 0, or 1 when standard output takes nothing.
int print_text(std::string_view text);
int print_json(const nlohmann::json& document);
/// On one line, flushed: for streams.
int print_json_line(const nlohmann::json& document);

/// What the terminal behind standard output is like. `colour`: it is a terminal, not a dumb one, and NO_COLOR
/// is not set.
struct OutputStyle {
    bool is_terminal = false;
    bool unicode = false;
    bool colour = false;
    std::size_t columns = 80;
};
/// REQUIRES: setlocale has been called.
OutputStyle output_style();

}  // namespace thermbal
