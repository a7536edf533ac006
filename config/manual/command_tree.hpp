#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace thermbal {

/// What a person may type of one option.
struct OptionWords {
    std::vector<std::string> flags;  ///< "-h", "--help"; empty for a positional
    std::string positional;          ///< its name in the usage
    std::string value;               ///< what stands for its value, as --help shows it; empty for a flag
    std::string description;
    std::string otherwise;    ///< the default; empty: none
    std::string environment;  ///< variable that stands for it
    bool required = false;
};

/// The visible options of one command, those of its option groups among them, in the order of their
/// definition.
std::vector<OptionWords> visible_options(const CLI::App& app);

/// The visible commands below this one, in the order of their definition.
std::vector<const CLI::App*> visible_commands(const CLI::App& app);

}  // namespace thermbal
