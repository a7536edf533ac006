#include "permissions.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/socket.h>
#include <unistd.h>

namespace thermbal {

namespace {

// Room for one entry of the user or group database; a group with more members than fit counts as unknown.
using EntryBuffer = std::vector<char>;
constexpr std::size_t entry_bytes = 256UL * 1024;

std::optional<gid_t> group_id(const std::string& name) {
    if (name.empty()) return std::nullopt;
    EntryBuffer buffer(entry_bytes);
    group entry{};
    group* found = nullptr;
    if (getgrnam_r(name.c_str(), &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr)
        return std::nullopt;
    return found->gr_gid;
}

struct User {
    std::string name;
    gid_t group = 0;
};

std::optional<User> user(uid_t uid) {
    EntryBuffer buffer(entry_bytes);
    passwd entry{};
    passwd* found = nullptr;
    if (getpwuid_r(uid, &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr)
        return std::nullopt;
    return User{found->pw_name, found->pw_gid};
}

bool listed_in_database(uid_t uid, gid_t wanted) {
    const auto entry = user(uid);
    if (!entry) return false;
    std::vector<gid_t> groups(64);
    auto count = static_cast<int>(groups.size());
    if (getgrouplist(entry->name.c_str(), entry->group, groups.data(), &count) < 0) {
        groups.resize(static_cast<std::size_t>(count));
        if (getgrouplist(entry->name.c_str(), entry->group, groups.data(), &count) < 0) return false;
    }
    groups.resize(static_cast<std::size_t>(count));
    return std::find(groups.begin(), groups.end(), wanted) != groups.end();
}

std::string name_of(uid_t uid) {
    const auto entry = user(uid);
    return entry ? entry->name : fmt::format("uid {}", uid);
}

}  // namespace

std::vector<gid_t> peer_groups(int connected_socket) {
    std::vector<gid_t> groups(64);
    for (int attempt = 0; attempt < 2; ++attempt) {
        auto bytes = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
        const int code = getsockopt(connected_socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &bytes);
        groups.resize(bytes / sizeof(gid_t));
        if (code == 0) return groups;
    }
    return {};
}

bool may_change(const Peer& peer, const std::vector<gid_t>& groups, const std::string& operators_group) {
    if (peer.uid == 0 || peer.uid == geteuid()) return true;
    const auto wanted = group_id(operators_group);
    if (!wanted) return false;
    return peer.gid == *wanted || std::find(groups.begin(), groups.end(), *wanted) != groups.end() ||
           listed_in_database(peer.uid, *wanted);
}

std::string denial(const Peer& peer, const std::string& method, const std::string& operators_group) {
    const std::string members = operators_group.empty()
                                    ? " may (no operators' group is configured)"
                                    : fmt::format(" and members of group {} may", operators_group);
    const std::string own = geteuid() == 0 ? "only root" : fmt::format("only root, {}", name_of(geteuid()));
    return fmt::format("{}: permission denied for {}: {}{}", method, name_of(peer.uid), own, members);
}

}  // namespace thermbal
