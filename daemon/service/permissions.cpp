#include "permissions.hpp"

#include <algorithm>
#include <utility>

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

std::string user_name(uid_t uid) {
    EntryBuffer buffer(entry_bytes);
    passwd entry{};
    passwd* found = nullptr;
    if (getpwuid_r(uid, &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr)
        return fmt::format("uid {}", uid);
    return found->pw_name;
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

Operators::Operators(std::string group)
    : group_(std::move(group)), group_id_(group_id(group_)), own_user_(user_name(geteuid())) {}

bool Operators::may_change(const Peer& peer, const std::vector<gid_t>& groups) const {
    if (peer.uid == 0 || peer.uid == geteuid()) return true;
    return group_id_ && (peer.gid == *group_id_ || std::ranges::find(groups, *group_id_) != groups.end());
}

std::string Operators::denial(const Peer& peer, const std::string& method) const {
    const std::string own = geteuid() == 0 ? "only root" : fmt::format("only root, {}", own_user_);
    const std::string members = group_.empty() ? " may (no operators' group is configured)"
                                : group_id_
                                    ? fmt::format(" and members of group {} may", group_)
                                    : fmt::format(
                                          " may (the operators' group {} was not there when the daemon "
                                          "started: make it, and restart the daemon)",
                                          group_);
    return fmt::format("{}: permission denied for uid {}: {}{}", method, peer.uid, own, members);
}

}  // namespace thermbal
