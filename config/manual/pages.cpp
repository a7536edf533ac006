#include <algorithm>
#include <cctype>
#include <cstdio>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "command_tree.hpp"
#include "manual/manual.hpp"

namespace thermbal {
namespace {

/// Text as roff prints it: no line of it is a request, and a minus stays a minus that can be copied.
std::string roff(std::string_view text) {
    std::string result;
    bool line_begins = true;
    for (const char c : text) {
        if (line_begins && (c == '.' || c == '\'')) result += "\\&";
        line_begins = c == '\n';
        if (c == '\\')
            result += "\\e";
        else if (c == '-')
            result += "\\-";
        else
            result += c;
    }
    return result;
}

std::string on_one_line(std::string text) {
    std::ranges::replace(text, '\n', ' ');
    return text;
}

std::string upper(std::string text) {
    std::ranges::transform(text, text.begin(),
                           [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return text;
}

std::string option_item(const OptionWords& option) {
    std::string head;
    for (const std::string& flag : option.flags)
        head += (head.empty() ? "\\fB" : ", \\fB") + roff(flag) + "\\fR";
    if (head.empty()) head = "\\fI" + roff(option.positional) + "\\fR";
    if (!option.value.empty() && !option.flags.empty()) head += " \\fI" + roff(option.value) + "\\fR";
    std::string text = ".TP\n" + head + "\n" + roff(on_one_line(option.description));
    if (option.required && !option.flags.empty()) text += " (required)";
    if (!option.otherwise.empty()) text += " (default: " + roff(option.otherwise) + ")";
    if (!option.environment.empty()) text += " (environment: " + roff(option.environment) + ")";
    return text + "\n";
}

std::string usage_of(const CLI::App& app, const std::string& path) {
    std::string usage = "\\fB" + roff(path) + "\\fR";
    if (!visible_options(app).empty()) usage += " [\\fIOPTIONS\\fR]";
    for (const OptionWords& option : visible_options(app))
        if (option.flags.empty()) usage += " \\fI" + roff(option.positional) + "\\fR";
    if (!visible_commands(app).empty()) usage += " \\fICOMMAND\\fR";
    return usage;
}

/// A footer keeps its lines: tables and examples stand in it.
std::string verbatim(const std::string& text) {
    return text.empty() ? "" : ".nf\n" + roff(text) + "\n.fi\n";
}

std::string command_sections(const CLI::App& app, const std::string& path) {
    std::string text;
    for (const CLI::App* command : visible_commands(app)) {
        const std::string name = path.empty() ? command->get_name() : path + " " + command->get_name();
        text +=
            ".SS " + usage_of(*command, name) + "\n" + roff(on_one_line(command->get_description())) + "\n";
        for (const OptionWords& option : visible_options(*command)) text += option_item(option);
        text += ".PP\n" + verbatim(command->get_footer()) + command_sections(*command, name);
    }
    return text;
}

}  // namespace

std::string manual_page(const CLI::App& app, const ManualPage& page) {
    const std::string description = app.get_description();
    std::string first = description.substr(0, description.find_first_of(".\n"));
    // NAME is "program - what it is", whatever --help begins with.
    if (first.starts_with(app.get_name() + ": ")) first.erase(0, app.get_name().size() + 2);
    std::string text = fmt::format(".\\\" Made from --help of the program itself.\n.TH {} {} \"\" thermbal\n",
                                   roff(upper(app.get_name())), page.section);
    text += fmt::format(".SH NAME\n{} \\- {}\n", roff(app.get_name()), roff(first));
    text += fmt::format(".SH SYNOPSIS\n{}\n", usage_of(app, app.get_name()));
    text += fmt::format(".SH DESCRIPTION\n{}\n", roff(description));
    text += ".SH OPTIONS\n";
    for (const OptionWords& option : visible_options(app)) text += option_item(option);
    const std::string commands = command_sections(app, "");
    if (!commands.empty()) text += ".SH COMMANDS\n" + commands;
    if (!app.get_footer().empty()) text += ".SH NOTES\n" + verbatim(app.get_footer());
    text +=
        ".SH EXIT STATUS\n0 done, 1 a failure at run time, 2 wrong usage or a configuration that is "
        "refused.\n";
    if (!page.files.empty()) text += ".SH FILES\n" + page.files;
    if (!page.see_also.empty()) text += ".SH SEE ALSO\n" + roff(page.see_also) + "\n";
    return text;
}

void add_manual_flags(CLI::App& app, const ManualPage& page) {
    const auto hidden = [&](const char* flag, auto make_text) {
        app.add_flag_callback(flag,
                              [&app, make_text] {
                                  std::fputs(make_text(app).c_str(), stdout);
                                  throw CLI::Success();
                              })
            ->group("")
            ->trigger_on_parse();
    };
    hidden("--print-manual", [page](const CLI::App& one) { return manual_page(one, page); });
    hidden("--print-bash-completion", bash_completion);
    hidden("--print-zsh-completion", zsh_completion);
}

}  // namespace thermbal
