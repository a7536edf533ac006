#include "publish/secrets.hpp"

#include <fmt/format.h>

#include "config/load.hpp"

namespace thermbal {

Result<std::string> secret_path(std::string_view name, std::string_view credentials_folder) {
    constexpr std::string_view scheme = "credential:";
    if (!name.starts_with(scheme)) return std::string(name);
    if (credentials_folder.empty())
        return fail(NextStep::refuse_input,
                    fmt::format("{}: systemd gave no credentials; add LoadCredential={}:/path to the unit",
                                name, name.substr(scheme.size())));
    return fmt::format("{}/{}", credentials_folder, name.substr(scheme.size()));
}

Result<std::string> read_secret(std::string_view name, std::string_view credentials_folder) {
    const auto path = secret_path(name, credentials_folder);
    if (!path) return path;
    auto secret = read_text_file(*path, std::size_t{64} * 1024);
    if (!secret) return secret;
    while (!secret->empty() && (secret->back() == '\n' || secret->back() == '\r')) secret->pop_back();
    if (secret->empty())
        return fail(NextStep::refuse_input,
                    fmt::format("{}: is empty; accepted: one line with the secret", *path));
    return secret;
}

}  // namespace thermbal
