#include "output.hpp"

#include <cstdlib>

#include <fmt/format.h>
#include <langinfo.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "columns.hpp"
#include "manual/standard_streams.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

std::string_view variable(const char* name) {
    const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nobody here sets variables
    return value == nullptr ? std::string_view() : value;
}

/// The few terminals that a person may still have without colours.
bool has_colours(std::string_view terminal) {
    const auto begins = [&](std::string_view name) { return terminal.starts_with(name); };
    return !(begins("vt1") || begins("vt2") || begins("vt5") || terminal.ends_with("-mono") ||
             terminal.ends_with("-m"));
}

}  // namespace

int report_error(const Error& error) {
    print_error_line("thermbalctl: " + printable(error.message));
    return error.next == NextStep::refuse_input ? 2 : 1;
}

int print_text(std::string_view text) {
    const auto printed = print_out(text);
    return printed ? 0 : report_error(printed.error());
}

int print_json(const json& document) {
    return print_text(document.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
}

int print_json_line(const json& document) {
    return print_text(document.dump(-1, ' ', false, json::error_handler_t::replace) + "\n");
}

OutputStyle output_style() {
    OutputStyle style;
    const std::string_view terminal = variable("TERM");
    style.is_terminal = isatty(STDOUT_FILENO) == 1 && !terminal.empty() && terminal != "dumb";
    style.unicode = std::string_view(nl_langinfo(CODESET)) == "UTF-8";  // NOLINT(concurrency-mt-unsafe)
    style.colour = style.is_terminal && variable("NO_COLOR").empty() && has_colours(terminal);
    winsize size{};
    if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) style.columns = size.ws_col;
    return style;
}

}  // namespace thermbal
