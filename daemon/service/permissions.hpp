#pragma once

#include <optional>
#include <string>
#include <vector>

#include "service/socket_server.hpp"

namespace thermbal {

/// The supplementary groups of the process at the other end, when it connected (SO_PEERGROUPS).
std::vector<gid_t> peer_groups(int connected_socket);

/// Who may change something: root, the daemon's own user, and the members of a group, by the groups that the
/// kernel says their process has.
class Operators {
  public:
    /// Looks up the group (empty: there is none) and the own user's name: may wait for a name service.
    /// Nothing below does.
    explicit Operators(std::string group);

    bool may_change(const Peer& peer, const std::vector<gid_t>& groups) const;

    /// What a person is told who may not.
    std::string denial(const Peer& peer, const std::string& method) const;

  private:
    std::string group_;
    std::optional<gid_t> group_id_;
    std::string own_user_;
};

}  // namespace thermbal
