#pragma once

#include <sys/socket.h>

namespace thermbal {

/// For httplib's set_socket_options: nobody else may listen on the same port at the same time, as httplib's
/// own SO_REUSEPORT would let them; a port that was just left may be taken at once.
inline void keep_port_alone(int socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

}  // namespace thermbal
