#pragma once

#include <string>
#include <vector>

#include "service/socket_server.hpp"

namespace thermbal {

/// The supplementary groups of the process at the other end, when it connected (SO_PEERGROUPS).
std::vector<gid_t> peer_groups(int connected_socket);

/// Root, the daemon's own user, or a member of the group: by the groups its process has, or by the group
/// database.
bool may_change(const Peer& peer, const std::vector<gid_t>& groups, const std::string& operators_group);

/// What a person is told who may not.
std::string denial(const Peer& peer, const std::string& method, const std::string& operators_group);

}  // namespace thermbal
