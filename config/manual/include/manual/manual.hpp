#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace thermbal {

/// What a manual page says that --help does not.
struct ManualPage {
    int section = 1;
    std::string files = {};     ///< roff, of the section FILES; empty: none
    std::string see_also = {};  ///< "thermbalctl(1), thermbald.toml(5)"
};

/// Hidden flags that print the manual page (roff, man(7)), or the completion for bash or zsh, of the program
/// as its --help describes it, and end the program with status 0: one source for all of them. Add last; `app`
/// has a name.
void add_manual_flags(CLI::App& app, const ManualPage& page);

/// The page and the completions themselves. Hidden options and commands (group "") are not in them.
std::string manual_page(const CLI::App& app, const ManualPage& page);
std::string bash_completion(const CLI::App& app);
std::string zsh_completion(const CLI::App& app);

}  // namespace thermbal
