#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "config/load.hpp"

namespace thermbal {
namespace {

namespace fs = std::filesystem;

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};

std::unexpected<Error> refuse_file(const std::string& path, std::string_view why) {
    return fail(NextStep::refuse_input, fmt::format("{}: {}", path, why));
}

Result<ModuleProfile> load_profile_file(const std::string& path) {
    const auto text = read_text_file(path);
    if (!text) return std::unexpected(text.error());
    auto profile = load_profile(*text, path);
    if (profile && profile->name.empty()) profile->name = fs::path(path).stem().string();
    return profile;
}

std::string profiles_there(const std::vector<std::string>& folders) {
    std::string names;
    for (const std::string& folder : folders) {
        std::error_code error;
        for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
             entry.increment(error)) {
            if (entry->path().extension() != ".toml") continue;
            names += (names.empty() ? "" : ", ") + entry->path().stem().string();
        }
    }
    return names.empty() ? "none" : names;
}

}  // namespace

Result<std::string> read_text_file(const std::string& path, std::size_t most_bytes) {
    std::error_code error;
    if (fs::is_directory(path, error)) return refuse_file(path, "is a folder; a file is needed");
    const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "rbe"));
    if (!file) return refuse_file(path, std::generic_category().message(errno));
    std::string text;
    std::string buffer(std::size_t{1} << 16, '\0');
    while (std::feof(file.get()) == 0 && std::ferror(file.get()) == 0) {
        text.append(buffer, 0, std::fread(buffer.data(), 1, buffer.size(), file.get()));
        if (text.size() > most_bytes) {
            return refuse_file(path, fmt::format("is larger than {} MiB", most_bytes >> 20));
        }
    }
    if (std::ferror(file.get()) != 0) return refuse_file(path, "cannot be read to its end");
    return text;
}

std::vector<std::string> profile_folders(std::vector<std::string> own) {
    own.emplace_back("/etc/thermbal/profiles");
    std::error_code none;
    const auto program = fs::read_symlink("/proc/self/exe", none);
    if (!none) own.push_back((program.parent_path().parent_path() / "share/thermbal/profiles").string());
    return own;
}

ProfileLookup profiles_in(std::vector<std::string> folders) {
    return [folders = std::move(folders)](std::string_view name) -> Result<ModuleProfile> {
        if (name.find('/') != std::string_view::npos || name.ends_with(".toml")) {
            return load_profile_file(std::string(name));
        }
        for (const std::string& folder : folders) {
            const std::string path = (fs::path(folder) / (std::string(name) + ".toml")).string();
            std::error_code error;
            if (fs::exists(path, error)) return load_profile_file(path);
        }
        return fail(NextStep::refuse_input,
                    fmt::format("no profile is named \"{}\"; accepted: a path, or one of {}", name,
                                profiles_there(folders)));
    };
}

Result<Config> load_config_file(const std::string& path, const ProfileLookup& lookup) {
    const auto text = read_text_file(path);
    if (!text) return std::unexpected(text.error());
    return load_config(*text, path, lookup);
}

}  // namespace thermbal
