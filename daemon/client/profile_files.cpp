#include "profile_files.hpp"

#include <algorithm>
#include <filesystem>

#include "config/load.hpp"

namespace thermbal {

std::vector<ModuleProfile> profiles_there(const std::vector<std::string>& own) {
    std::vector<ModuleProfile> profiles;
    for (const std::string& folder : profile_folders(own)) {
        std::error_code error;
        std::vector<std::string> paths;
        for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
             entry.increment(error)) {
            if (entry->path().extension() == ".toml") paths.push_back(entry->path().string());
        }
        std::ranges::sort(paths);
        for (const std::string& path : paths) {
            if (auto profile = profiles_in({})(path)) profiles.push_back(std::move(*profile));
        }
    }
    return profiles;
}

}  // namespace thermbal
