#include "command_tree.hpp"

#include <algorithm>

namespace thermbal {
namespace {

OptionWords words_of(const CLI::Option& option) {
    OptionWords words;
    for (const std::string& name : option.get_snames()) words.flags.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) words.flags.push_back("--" + name);
    if (words.flags.empty()) words.positional = option.get_name(true);
    if (option.get_items_expected_max() != 0) words.value = option.get_type_name();
    words.description = option.get_description();
    words.otherwise = option.get_default_str();
    words.environment = option.get_envname();
    words.required = option.get_required();
    return words;
}

/// An option group is a nameless command of CLI11.
bool is_option_group(const CLI::App* command) {
    return command->get_name().empty();
}

}  // namespace

std::vector<OptionWords> visible_options(const CLI::App& app) {
    std::vector<OptionWords> found;
    const auto is_visible = [](const CLI::Option* option) { return !option->get_group().empty(); };
    for (const CLI::Option* option : app.get_options(is_visible)) found.push_back(words_of(*option));
    for (const CLI::App* group :
         app.get_subcommands([](const CLI::App* one) { return is_option_group(one); }))
        for (OptionWords& option : visible_options(*group)) {
            // A group has the --help of its command once more.
            const bool known = std::ranges::find(found, option.flags, &OptionWords::flags) != found.end();
            if (!known || option.flags.empty()) found.push_back(std::move(option));
        }
    return found;
}

std::vector<const CLI::App*> visible_commands(const CLI::App& app) {
    return app.get_subcommands(
        [](const CLI::App* command) { return !is_option_group(command) && !command->get_group().empty(); });
}

}  // namespace thermbal
