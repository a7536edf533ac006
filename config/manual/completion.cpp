#include <algorithm>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "command_tree.hpp"
#include "manual/manual.hpp"

namespace thermbal {
namespace {

/// Calls `visit(path, command)` for a program and every command below it; the path of "probe tcp" is
/// "/probe/tcp".
void each_command(const CLI::App& app, const std::string& path,
                  const std::function<void(const std::string&, const CLI::App&)>& visit) {
    visit(path, app);
    for (const CLI::App* command : visible_commands(app))
        each_command(*command, path + "/" + command->get_name(), visit);
}

/// A name as part of a shell function.
std::string function_name(std::string name) {
    std::ranges::replace(name, '-', '_');
    return "_" + name;
}

/// In single quotes, for a shell.
std::string single_quoted(std::string_view text) {
    std::string result = "'";
    for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return result + "'";
}

/// The branches that walk over the words of the line: which of them are commands.
std::string path_branches(const CLI::App& app) {
    std::string branches;
    each_command(app, "", [&](const std::string& path, const CLI::App&) {
        if (!path.empty()) branches += fmt::format("            {}) path={} ;;\n", path, path);
    });
    return branches;
}

std::string flags_with_values(const CLI::App& app) {
    std::vector<std::string> flags;
    each_command(app, "", [&](const std::string&, const CLI::App& command) {
        for (const OptionWords& option : visible_options(command))
            if (!option.value.empty()) flags.insert(flags.end(), option.flags.begin(), option.flags.end());
    });
    std::ranges::sort(flags);
    flags.erase(std::unique(flags.begin(), flags.end()), flags.end());
    return fmt::format("{}", fmt::join(flags, "|"));
}

std::string bash_words(const CLI::App& command) {
    std::vector<std::string> words;
    for (const CLI::App* below : visible_commands(command)) words.push_back(below->get_name());
    for (const OptionWords& option : visible_options(command))
        words.insert(words.end(), option.flags.begin(), option.flags.end());
    return fmt::format("{}", fmt::join(words, " "));
}

/// "word:what it is", as _describe of zsh wants it.
std::string described(const std::string& word, std::string what) {
    std::ranges::replace(what, '\n', ' ');
    return single_quoted(word + ":" + what);
}

std::string zsh_lists(const CLI::App& command) {
    std::vector<std::string> commands;
    for (const CLI::App* below : visible_commands(command))
        commands.push_back(described(below->get_name(), below->get_description()));
    std::vector<std::string> flags;
    for (const OptionWords& option : visible_options(command))
        for (const std::string& flag : option.flags) flags.push_back(described(flag, option.description));
    return fmt::format("commands=({}) flags=({})", fmt::join(commands, " "), fmt::join(flags, " "));
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
    const std::string function = function_name(app.get_name());
    std::string text = fmt::format(
        "# bash completion for {0}, made from its --help.\n{1}() {{\n    local path= word words=\n"
        "    local current=${{COMP_WORDS[COMP_CWORD]}}\n"
        "    for word in \"${{COMP_WORDS[@]:1:COMP_CWORD-1}}\"; do\n        case $path/$word in\n{2}        "
        "esac\n"
        "    done\n",
        app.get_name(), function, path_branches(app));
    const std::string valued = flags_with_values(app);
    // A value is a file as far as a shell knows: the default of `complete -o default`.
    if (!valued.empty())
        text += fmt::format("    case ${{COMP_WORDS[COMP_CWORD-1]}} in {}) COMPREPLY=(); return ;; esac\n",
                            valued);
    text += "    case $path in\n";
    each_command(app, "", [&](const std::string& path, const CLI::App& command) {
        text += fmt::format("        {}) words={} ;;\n", path.empty() ? "''" : path,
                            single_quoted(bash_words(command)));
    });
    text += fmt::format(
        "    esac\n    mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n}}\n"
        "complete -o default -F {} {}\n",
        function, app.get_name());
    return text;
}

std::string zsh_completion(const CLI::App& app) {
    const std::string function = function_name(app.get_name());
    std::string text = fmt::format(
        "#compdef {0}\n# Made from --help of {0}.\n{1}() {{\n    local path_of_command= word\n    local -a "
        "commands flags\n"
        "    for word in \"${{(@)words[2,CURRENT-1]}}\"; do\n        case $path_of_command/$word in\n",
        app.get_name(), function);
    each_command(app, "", [&](const std::string& path, const CLI::App&) {
        if (!path.empty()) text += fmt::format("            {}) path_of_command={} ;;\n", path, path);
    });
    text += "        esac\n    done\n";
    const std::string valued = flags_with_values(app);
    if (!valued.empty())
        text += fmt::format("    case $words[CURRENT-1] in {}) _files; return ;; esac\n", valued);
    text += "    case $path_of_command in\n";
    each_command(app, "", [&](const std::string& path, const CLI::App& command) {
        text += fmt::format("        {}) {} ;;\n", path.empty() ? "''" : path, zsh_lists(command));
    });
    text += fmt::format(
        "    esac\n    if [[ $words[CURRENT] == -* || ${{#commands}} -eq 0 && -z $words[CURRENT] ]]; then\n"
        "        _describe option flags\n    elif (( ${{#commands}} )); then\n        _describe command "
        "commands\n"
        "    else\n        _files\n    fi\n}}\n"
        "if [[ $zsh_eval_context[-1] == loadautofunc ]]; then {0} \"$@\"; else compdef {0} {1}; fi\n",
        function, app.get_name());
    return text;
}

}  // namespace thermbal
